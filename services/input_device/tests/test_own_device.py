"""The page about own devices: its code is run as it stands, by the service's own machinery."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs_input_device.devices.kinds import KINDS
from hmcs_input_device.guarded import FROZEN_S
from hmcs_input_device.press_gate import SILENT_S
from hmcs_input_device.sources import ENTRY_POINTS, FARTHEST_M, FASTEST_M_S

PAGE = (Path(__file__).parents[3] / "docs/how-to/own-device.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.fixture
def named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Install what the page says as a distribution; return the name of its source."""
    (code,), (manifest,) = blocks("python"), blocks("toml")
    entries = tomllib.loads(manifest)["project"]["entry-points"][ENTRY_POINTS]
    ((name, place),) = entries.items()
    module = place.partition(":")[0]
    (tmp_path / f"{module}.py").write_text(code, encoding="utf-8")
    info = tmp_path / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{ENTRY_POINTS}]\n{name} = {place}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, module, raising=False)
    return name


def test_the_device_of_the_page_moves_as_it_stands_there(
    make_desk: Callable[..., Any], named: str
) -> None:
    assert f"--source {named}" in PAGE
    desk = make_desk(source=named, dead_zone_m=0.002)
    assert not desk.motions[0].body.dead_man
    desk.until(lambda: len(desk.steps) > 3, "steps")
    assert desk.service.health() == (True, "playing")
    held = [received.body for received in desk.motions if received.body.dead_man]
    assert held
    for motion in held:
        np.testing.assert_allclose(np.linalg.norm(motion.position), 0.05, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(motion.velocity), 0.025, atol=1e-9)


def test_the_numbers_of_the_page_are_those_of_the_code() -> None:
    rows = {
        cells[0].strip(" `"): cells
        for cells in re.findall(r"^\|(.*)\|$", PAGE, re.MULTILINE)
        for cells in [cells.split("|")]
    }
    for kind in KINDS:
        silence, cells = kind.usual.silence, rows[kind.name]
        if kind.usual.kind == "rate":
            assert cells[2].strip() == f"{silence.deflected_s:g} s"
        assert cells[3].strip() == f"{silence.resting_s:g} s"
    assert [cell.strip() for cell in rows["page"][2:4]] == [f"{SILENT_S:g} s"] * 2
    assert f"beyond {FARTHEST_M / 1000:g} km, a hand faster than {FASTEST_M_S:g} m/s" in PAGE
    assert "for half a second" in PAGE
    assert FROZEN_S == 0.5
