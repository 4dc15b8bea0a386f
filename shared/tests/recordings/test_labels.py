"""Labels said meanwhile or written beside a recording, and the demonstrations they make."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hmcs.bus.messages import Motion
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.labels import labels_beside, labels_of, write_labels
from hmcs.recordings.reading import RecordingError, read
from support.recordings import Maker, Said


def test_labels_said_meanwhile_begin_with_the_step_they_name(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    content = read(maker.write(performed(("go", "turn", "go"))))
    assert [label.state for label in labels_of(content)] == ["go", "turn", "go"]
    (demonstration,) = demonstrations_of(content)
    assert demonstration.states[0] == "go"
    switches = np.flatnonzero(demonstration.switches)
    turn = int(switches[1])
    # The step that ended before the label was said lasted a few samples into it.
    heading = np.diff(demonstration.positions, axis=0)
    assert abs(turn - int(np.flatnonzero(heading[:, 1])[0])) <= 6
    assert demonstration.time_s[0] == 0.02


def test_labels_beside_a_recording_count_instead_and_never_change_it(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    path = maker.write(performed())
    before = path.read_bytes()
    said = labels_of(read(path))
    write_labels(read(path), [said[0]._replace(state="other")])
    assert [label.state for label in labels_of(read(path))] == ["other"]
    assert path.read_bytes() == before
    (demonstration,) = demonstrations_of(read(path))
    assert set(demonstration.states) == {"other"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("begin,end\n", ":1: expected the header"),
        ("begin_s,end_s,state\n0,1,go\n0.5,2,turn\n", ":3: begins before the label above it ends"),
        ("begin_s,end_s,state\n1,0,go\n", ":2: expected begin_s below end_s"),
        ("begin_s,end_s,state\n0,1,\n", ":2: expected begin_s below end_s, and a state"),
        ("begin_s,end_s,state\n0,inf,go\n", ":2: expected begin_s"),
        ("begin_s,end_s,state\n0,1\n", ":2: expected begin_s,end_s,state"),
    ],
)
def test_labels_that_cannot_be_are_reported_with_their_line(
    maker: Maker, performed: Callable[..., list[Said]], text: str, says: str
) -> None:
    path = maker.write(performed())
    labels_beside(path).write_text(text)
    with pytest.raises(RecordingError, match=says):
        labels_of(read(path))


def test_motion_that_was_not_engaged_leaves_no_jump(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    said = performed(("go",))
    far = [
        (key, body.model_copy(update={"position": np.add(body.position, [0.0, 0.0, 0.5])}))
        if isinstance(body, Motion)
        else (key, body)
        for key, body in performed(("turn",))[1:-1]
        if isinstance(body, Motion)
    ]
    loose = (said[0][0], far[0][1].model_copy(update={"dead_man": False}))
    (demonstration,) = demonstrations_of(read(maker.write([*said[:-2], loose, *far])))
    steps = np.linalg.norm(np.diff(demonstration.positions, axis=0), axis=1)
    assert steps.max() < 0.01


def test_a_recording_without_labels_is_one_demonstration_without_labels(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    unsaid = [(key, body) for key, body in performed((None, None)) if "label" not in key]
    (demonstration,) = demonstrations_of(read(maker.write(unsaid)))
    assert set(demonstration.states) == {None}
    assert len(demonstration.positions) == 120


def test_each_run_of_labels_is_a_demonstration_of_its_own(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    twice = demonstrations_of(read(maker.write(performed(("go", None, "turn")))))
    assert [each.name for each in twice] == ["take.mcap#1", "take.mcap#2"]
