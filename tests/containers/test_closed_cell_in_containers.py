"""The stack with compose.secure.yaml: it works, and nobody without a certificate joins it."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest
import zenoh
from typer.testing import CliRunner

from hmcs.bus.config import BusSettings, client_config
from hmcs_secure.closed_cell import ClosedCell, find_closed_cell
from hmcs_secure.command import app

pytestmark = pytest.mark.containers

Pump = Callable[..., None]


@pytest.fixture(scope="module")
def closed_cell(tmp_path_factory: pytest.TempPathFactory) -> ClosedCell:
    if os.geteuid() != 0:
        pytest.skip("only root hands keys to the user of the containers")
    folder = tmp_path_factory.mktemp("secure")
    for word in ("init", "containers"):
        done = CliRunner().invoke(app, [word, "container-test", "--folder", str(folder)])
        assert done.exit_code == 0, done.output
    return find_closed_cell(str(folder / "container-test"))


def test_belief_reaches_the_robot_of_a_closed_cell(assisted: Any) -> None:
    assert assisted.guiding.reason == "guiding"
    assert assisted.moving.stop == "none"


def test_docker_finds_every_container_of_a_closed_cell_healthy(
    containers: Any, pump_until: Pump
) -> None:
    def health() -> set[str]:
        states = containers.states().values()
        return {state["Health"]["Status"] for state in states if "Health" in state}

    pump_until(lambda: health() == {"healthy"})


@pytest.mark.parametrize("link", ["tcp", "tls"])
def test_without_a_certificate_nobody_joins_a_closed_cell(
    containers: Any, closed_cell: ClosedCell, link: str
) -> None:
    tls = closed_cell.credentials("operator")._asdict() if link == "tls" else {}
    settings = BusSettings(
        router=f"{link}/127.0.0.1:{containers.port}", cell=containers.cell, **tls
    )
    config = client_config(settings)
    if tls:
        config.insert_json5("transport/link/tls/connect_certificate", "null")
        config.insert_json5("transport/link/tls/connect_private_key", "null")
    config.insert_json5("connect/timeout_ms", "2000")
    with pytest.raises(zenoh.ZError):
        zenoh.open(config)
