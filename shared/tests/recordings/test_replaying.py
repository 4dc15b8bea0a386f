"""Which model a recording is replayed with, and with which one it cannot be."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from hmcs.recordings.parts import Preface, Recording
from hmcs.recordings.reading import RecordingError, read
from hmcs.recordings.replaying import kept_model
from support.lessons import lesson_task, performed
from support.recordings import BEGUN_NS, ROOMY

Take = Callable[..., Path]


@pytest.fixture
def take(tmp_path: Path) -> Take:
    """A recording with models kept with it, and the one its fixture followed."""

    def write(*names: str, followed: str = "") -> Path:
        model, kept = learn(lesson_task(), [performed(1)]), {}
        for name in names:
            file = tmp_path / f"{name}.hmcs"
            save_model(model._replace(name=name), file)
            kept[file.name] = file.read_bytes()
        told = {"active_model": followed, "settings": json.dumps({})}
        preface = Preface({"fixture_controller/f": told}, kept)
        recording = Recording(tmp_path / "takes", "take", ROOMY, lambda: preface, BEGUN_NS, "test")
        recording.finish()
        return recording.path

    return write


@pytest.mark.parametrize(
    ("names", "followed", "chosen"),
    [(("one",), "", "one"), (("one", "two"), "two", "two"), (("one",), "gone", "one")],
)
def test_the_model_kept_alone_or_followed_is_replayed(
    take: Take, names: tuple[str, ...], followed: str, chosen: str
) -> None:
    assert kept_model(read(take(*names, followed=followed))).name == chosen


@pytest.mark.parametrize(("names", "says"), [((), "none"), (("one", "two"), "one.hmcs, two.hmcs")])
def test_where_nobody_knows_which_the_models_there_are_told(
    take: Take, names: tuple[str, ...], says: str
) -> None:
    with pytest.raises(RecordingError, match=f"{says}; name one with --model"):
        kept_model(read(take(*names)))
