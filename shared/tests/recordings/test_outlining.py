"""The outline of a recording, and labels set by it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Motion
from hmcs.recordings.demonstrations import demonstrations_of, performances_of, stretches_of
from hmcs.recordings.generated_marker import is_unchanged_generated
from hmcs.recordings.labels import how_labeled, labels_beside, labels_of, write_labels
from hmcs.recordings.outlining import outlined, recording_named, recordings_in, set_labels
from hmcs.recordings.reading import RecordingError, read
from hmcs.recordings.stretches import LabelError
from support.recordings import Maker, Said

Performed = Callable[..., list[Said]]


def moved(said: list[Said], by: np.ndarray) -> list[Said]:
    """The same hand elsewhere."""
    return [
        (key, body.model_copy(update={"position": body.position + by}))
        if isinstance(body, Motion)
        else (key, body)
        for key, body in said
    ]


def unsaid(said: list[Said]) -> list[Said]:
    return [(key, body) for key, body in said if "label" not in key]


def test_an_outline_has_the_way_of_the_hand_and_its_labels_in_seconds(
    maker: Maker, performed: Performed
) -> None:
    content = read(maker.write(performed(("go", "turn"))))
    outline = outlined(content)
    (demonstration,) = demonstrations_of(content)
    np.testing.assert_array_equal(outline.positions, demonstration.positions)
    np.testing.assert_array_equal(outline.time_s, demonstration.time_s)
    assert outline.states == ("go", "turn")
    labels = labels_of(content)
    begins_s = [(label.begin_ns - content.first_ns) / 1e9 for label in labels]
    np.testing.assert_allclose(outline.begin_s, begins_s, atol=1e-9)
    assert outline.duration_s == content.duration_s


def test_an_outline_of_a_long_recording_is_evenly_thinned_out(
    maker: Maker, performed: Performed
) -> None:
    content = read(maker.write(performed(("go", "turn"), 400)))
    outline, whole = outlined(content, most=100), outlined(content, most=10**6)
    assert len(outline.time_s) == 100
    assert (outline.time_s[0], outline.time_s[-1]) == (whole.time_s[0], whole.time_s[-1])
    assert np.diff(outline.time_s).max() <= 2 * np.diff(outline.time_s).min()


def test_a_recording_without_motion_has_an_empty_outline(
    maker: Maker, performed: Performed
) -> None:
    content = read(maker.write(performed(("go",))[:2]))
    outline = outlined(content)
    assert outline.time_s.shape == (0,)
    assert outline.positions.shape == (0, 3)


def test_labels_that_are_set_stand_beside_the_recording_which_stays_as_it_was(
    maker: Maker, performed: Performed
) -> None:
    path = maker.write(performed(("go", "turn")))
    before = path.read_bytes()
    file = set_labels(read(path), [0.1, 0.5], [0.5, 0.9], ["turn", "go"])
    assert file.read_text().startswith("begin_s,end_s,state\n0.1,0.5,turn\n0.5,0.9,go\n# of ")
    assert path.read_bytes() == before
    assert outlined(read(path)).states == ("turn", "go")
    assert how_labeled(read(path)) == "set afterwards"


@pytest.mark.parametrize(
    ("begin_s", "end_s"), [([0.1, 0.4], [0.5, 0.9]), ([0.5], [0.1]), ([0.5], [99.0]), ([], [0.1])]
)
def test_labels_that_cannot_be_leave_those_there_are(
    maker: Maker, performed: Performed, begin_s: list[float], end_s: list[float]
) -> None:
    content = read(maker.write(performed(("go", "turn"))))
    file = set_labels(content, [0.1], [0.5], ["turn"])
    before = file.read_bytes()
    with pytest.raises(LabelError):
        set_labels(content, begin_s, end_s, ["go"] * len(end_s))
    assert file.read_bytes() == before


def test_recordings_are_reported_newest_first_and_found_by_name(
    maker: Maker, performed: Performed
) -> None:
    paths = [maker.write(performed(("go",)), name) for name in ("one", "two")]
    for age, path in enumerate(paths):
        os.utime(path, (1000 + age, 1000 + age))
    assert [file.name for file in recordings_in(maker.folder)] == ["two.mcap", "one.mcap"]
    assert recording_named(maker.folder, "one.mcap") == paths[0]
    assert recording_named(maker.folder, "") == paths[1]


@pytest.mark.parametrize("name", ["../out.mcap", "in/side.mcap", "none.mcap", ".", "..", "/x.mcap"])
def test_a_name_never_leads_out_of_the_folder(
    maker: Maker, performed: Performed, name: str
) -> None:
    maker.write(performed(("go",)), "one")
    inside = maker.folder / "in"
    inside.mkdir()
    for place in (maker.folder.parent / "out.mcap", inside / "side.mcap"):
        place.write_bytes((maker.folder / "one.mcap").read_bytes())
    with pytest.raises(RecordingError, match=r"there is no recording .*choose of one\.mcap"):
        recording_named(maker.folder, name)


def test_an_empty_folder_says_so(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="there are no recordings yet"):
        recording_named(tmp_path, "")


# --- performances without labels ------------------------------------------------------------------


def test_taking_hold_again_where_it_began_begins_anew(maker: Maker, performed: Performed) -> None:
    once = unsaid(performed((None, None)))
    found = performances_of(read(maker.write([*once, *once, *once])))
    assert [each.name for each in found] == ["take.mcap#1", "take.mcap#2", "take.mcap#3"]
    assert [len(each.positions) for each in found] == [120, 120, 120]
    np.testing.assert_array_equal(found[0].positions, found[2].positions)
    assert found[1].time_s[0] > found[0].time_s[-1]


def test_taking_hold_again_where_it_was_let_go_goes_on(maker: Maker, performed: Performed) -> None:
    first = unsaid(performed((None,)))
    rest = moved(unsaid(performed((None,))), np.array([0.13, 0.0, 0.0]))
    (found,) = performances_of(read(maker.write([*first, *rest])))
    assert len(found.positions) == 120
    assert np.linalg.norm(np.diff(found.positions, axis=0), axis=1).max() < 0.01


def test_labels_made_of_demonstrations_make_the_very_same_again(
    maker: Maker, performed: Performed
) -> None:
    once = unsaid(performed((None, None)))
    path = maker.write([*once, *once])
    content = read(path)
    given = [each._replace(states=("a",) * 50 + ("b",) * 70) for each in performances_of(content)]
    write_labels(content, stretches_of(given, content.first_ns))
    again = demonstrations_of(read(path))
    for one, other in zip(given, again, strict=True):
        assert one.states == other.states
        np.testing.assert_array_equal(one.positions, other.positions)
        np.testing.assert_array_equal(one.time_s, other.time_s)


# --- found labels ---------------------------------------------------------------------------------


def test_found_labels_are_distinguished_from_those_somebody_changed(
    maker: Maker, performed: Performed
) -> None:
    path = maker.write(performed(("go", "turn")))
    content, file = read(path), labels_beside(path)
    assert not is_unchanged_generated(file)
    assert how_labeled(content) == "said meanwhile"
    said = labels_of(content)
    write_labels(content, said, found=True)
    assert how_labeled(content) == "found"
    assert labels_of(content) == said
    file.write_text(file.read_text().replace("turn", "go"))
    assert how_labeled(content) == "set afterwards"
