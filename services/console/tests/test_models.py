"""Models that guides are drawn of: looked for in files, seldom, whoever tells of them."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs_console.seeing.models import (
    MOST_MISSED,
    MOST_TOLD,
    READ_EVERY_S,
    Models,
    guide_of,
    load_models,
    task_of,
)

LOG = logging.getLogger("test")


def test_models_are_found_in_files_and_folders(model_file: Path, tmp_path: Path) -> None:
    assert [model.name for model in load_models([model_file])] == ["lines"]
    assert [model.name for model in load_models([model_file.parent])] == ["lines"]
    # It may fill while the page is open.
    assert load_models([tmp_path]) == ()


def test_the_task_is_the_named_one_else_that_of_the_first_model(model_file: Path) -> None:
    models = load_models([model_file])
    named, of_model = task_of("surface-2d", models), task_of(None, models)
    assert named is not None
    assert of_model is not None
    assert (named.name, of_model.name) == ("surface-2d", "made-up")
    assert task_of(None, ()) is None


def test_a_guide_is_the_learned_path_with_the_volume_of_its_state(model_file: Path) -> None:
    (model,) = load_models([model_file])
    free, cone = guide_of(model, "free", "line"), guide_of(model, "in", "line")
    assert free is not None
    assert_allclose(free.points[:, 0], [0, 0.25, 0.5])
    assert free.volume is None
    assert cone is not None
    assert cone.volume is not None
    radii = np.linalg.norm(cone.volume.vertices[:, 1:], axis=1).reshape(3, -1)
    assert_allclose(radii[:, 0], [0.05, 0.03, 0.01])
    assert guide_of(model, "in", "strange") is None


def test_a_guide_is_as_large_as_the_robot_is_led(model_file: Path) -> None:
    (model,) = load_models([model_file])
    fixture = model.task.fixture.model_copy(update={"operator_scale": 0.5})
    halved = model._replace(task=model.task.model_copy(update={"fixture": fixture}))
    guide = guide_of(halved, "in", "line")
    assert guide is not None
    assert guide.volume is not None
    assert_allclose(guide.points[:, 0], [0, 0.125, 0.25])
    assert_allclose(np.abs(guide.volume.vertices[:, 1:]).max(), 0.025)


def test_a_model_is_found_by_its_hash_whatever_its_recognizer_is_called(model_file: Path) -> None:
    (model,) = load_models([model_file])
    models = Models((model,), (), LOG)
    assert models.find("a shadow of it", model.hash) is model
    assert models.find("lines", "") is model
    assert models.find("lines", "another hash") is None
    assert models.find("strange", "") is None


def test_a_model_is_looked_for_in_files_once_until_another_is_written(
    model_file: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (model,) = load_models([model_file])
    places = (tmp_path / "damaged.hmcs", tmp_path / "nowhere")
    places[0].write_bytes(b"no model")
    now_s = [0.0]
    models = Models((), places, LOG, lambda: now_s[0])
    with caplog.at_level(logging.INFO):
        assert models.find("lines", model.hash) is None
        assert models.find("lines", model.hash) is None
    assert len(caplog.records) == 1
    models.look_in(str(model_file))
    now_s[0] = READ_EVERY_S
    found = models.find("lines", model.hash)
    assert found is not None
    assert found.hash == model.hash


def test_whoever_tells_of_ever_new_models_has_no_file_read_more_often(
    model_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []
    now_s = [0.0]
    monkeypatch.setattr("hmcs_console.seeing.models.load_model", read.append)
    monkeypatch.setattr(Models, "_take", lambda *_: None)
    models = Models((), (model_file,), LOG, lambda: now_s[0])
    for number in range(1000):
        models.look_in(f"/somewhere/{number}.hmcs")
        assert models.find("lines", f"hash {number}") is None
        now_s[0] += 0.01
    assert read.count(model_file) == pytest.approx(10.0 / READ_EVERY_S, abs=1)
    assert len(models._named_files) == MOST_TOLD
    assert len(models._missed) <= MOST_MISSED


@pytest.mark.parametrize(
    "path", ["/etc/passwd", "/m/a\x00.hmcs", "/m/a\n.hmcs", "", "/m/" + "x" * 5000 + ".hmcs", "/m"]
)
def test_a_path_that_is_reported_and_is_none_of_a_model_file_is_not_looked_at(path: str) -> None:
    models = Models((), (), LOG)
    models.look_in(path)
    assert not models._named_files
    assert models.find("lines", "hash") is None
