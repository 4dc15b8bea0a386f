"""One hand drives at a time, whatever other devices are in a recording."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import NamedTuple

import numpy as np
import pytest

from hmcs.bus.messages import Motion, Source
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.demonstrations import demonstrations_of, performances_of
from hmcs.recordings.hands import hand_of
from hmcs.recordings.labels import write_labels
from hmcs.recordings.outlining import outlined
from hmcs.recordings.reading import RecordingContent, read
from hmcs.recordings.stretches import Stretch
from support.recordings import BEGUN_NS, KEYS, Maker

MS = 1_000_000


class Sent(NamedTuple):
    at_ms: int
    device: str
    x_m: float
    dead_man: bool = True
    clutch: bool = False


Recorded = Callable[..., RecordingContent]


@pytest.fixture
def recorded(maker: Maker) -> Recorded:
    """A recording of what several devices sent, in the order of time."""
    names = count()

    def record(*sent: list[Sent]) -> RecordingContent:
        recording = maker.begin(f"take-{next(names)}")
        rows = sorted((each for one in sent for each in one), key=lambda each: each.at_ms)
        for number, each in enumerate(rows):
            motion = Motion(
                position=np.array([each.x_m, 0.0, 0.0]),
                velocity=np.zeros(3),
                dead_man=each.dead_man,
                clutch=each.clutch,
            )
            source = Source(service="input_device", instance=each.device, boot=each.device)
            at_ns = BEGUN_NS + each.at_ms * MS
            recording.write(KEYS.motion, maker.fields(motion, number, source), at_ns, None)
        recording.finish()
        return read(recording.path)

    return record


def moving(device: str, begin_ms: int, samples: int, at_m: float = 0.0) -> list[Sent]:
    """A device that is engaged and moves by a millimeter each 10 ms."""
    return [Sent(begin_ms + 10 * k, device, at_m + 0.001 * k) for k in range(samples)]


def idle(device: str, begin_ms: int, samples: int, at_m: float = 5.0) -> list[Sent]:
    return [Sent(begin_ms + 10 * k, device, at_m, dead_man=False) for k in range(samples)]


def lengths(found: list[Demonstration]) -> list[int]:
    return [len(each.time_s) for each in found]


@pytest.mark.parametrize("begin_ms", [-5, 5], ids=["comes first", "comes second"])
def test_a_device_that_idles_changes_nothing(recorded: Recorded, begin_ms: int) -> None:
    hand = [*moving("hand", 0, 100), *idle("hand", 1000, 1, 0.1), *moving("hand", 1010, 40, 0.1)]
    expected = performances_of(recorded(hand))
    both = recorded(hand, idle("page", begin_ms, 150))
    assert lengths(expected) == [140]
    for found in (performances_of(both), demonstrations_of(both)):
        np.testing.assert_array_equal(found[0].positions, expected[0].positions)
        np.testing.assert_allclose(np.diff(found[0].time_s), np.diff(expected[0].time_s))
        assert len(found) == 1
    np.testing.assert_array_equal(outlined(both).positions, expected[0].positions)


def test_of_two_engaged_devices_the_first_counts_until_it_lets_go(recorded: Recorded) -> None:
    first = [*moving("first", 0, 50), *idle("first", 500, 30, 0.05)]
    content = recorded(first, moving("second", 205, 60, 3.0))
    devices = [sample.device for sample in hand_of(content) if sample.engaged]
    assert devices == ["first"] * 50 + ["second"] * 30
    assert lengths(performances_of(content)) == lengths(demonstrations_of(content)) == [50, 30]
    # The way goes on where it was: devices measure from zeros of their own.
    assert np.abs(np.diff(outlined(content).positions, axis=0)).max() < 0.0015


@pytest.mark.parametrize(("silent_ms", "takes_over"), [(480, False), (520, True)])
def test_a_device_that_is_silent_for_half_a_second_is_gone(
    recorded: Recorded, silent_ms: int, takes_over: bool
) -> None:
    first = [*moving("first", 0, 11), Sent(100 + silent_ms + 2, "first", 0.02)]
    content = recorded(first, moving("second", 101, (silent_ms - 1) // 10 + 1, 3.0))
    assert ("second" in {sample.device for sample in hand_of(content)}) == takes_over


def test_a_device_that_was_started_anew_begins_a_performance(recorded: Recorded) -> None:
    content = recorded(moving("boot-1", 0, 30), moving("boot-2", 1000, 40, 7.0))
    assert lengths(performances_of(content)) == [30, 40]
    assert np.abs(np.diff(outlined(content).positions, axis=0)).max() < 0.0015
    for found in (performances_of(content), demonstrations_of(content)):
        assert max(np.abs(np.diff(each.positions, axis=0)).max() for each in found) < 0.0015


def test_labeled_motion_is_cut_at_a_change_of_device_too(recorded: Recorded) -> None:
    content = recorded(moving("one", 0, 30), moving("other", 1000, 40, 7.0))
    write_labels(content, [Stretch(content.first_ns, content.last_ns, "go")])
    assert lengths(demonstrations_of(read(content.path))) == [30, 39]


def test_unlabeled_time_between_labels_parts_demonstrations_though_no_device_moves(
    recorded: Recorded,
) -> None:
    content = recorded(
        [*moving("one", 0, 30), *idle("one", 300, 20, 0.03), *moving("one", 500, 30, 0.03)],
        idle("other", 3, 100),
    )
    whole = Stretch(BEGUN_NS, content.last_ns, "go")
    parts = [
        whole._replace(end_ns=BEGUN_NS + 310 * MS),
        whole._replace(begin_ns=BEGUN_NS + 480 * MS),
    ]
    for labels, expected in ((parts, [30, 30]), ([whole], [60])):
        write_labels(content, labels)
        assert lengths(demonstrations_of(read(content.path))) == expected


def test_motion_made_while_the_hand_lets_go_leaves_no_jump(recorded: Recorded) -> None:
    """Neither on the way, nor in the last moment before it takes hold again."""
    away = idle("one", 300, 5, 0.8)
    content = recorded([*moving("one", 0, 30), *away, *moving("one", 400, 30, 2.0)])
    (one,) = demonstrations_of(content)
    assert np.abs(np.diff(one.positions, axis=0)).max() < 0.0015
    clutched = [each._replace(clutch=True, dead_man=True) for each in away]
    (one,) = demonstrations_of(
        recorded([*moving("one", 0, 30), *clutched, *moving("one", 400, 30, 2.0)])
    )
    assert np.abs(np.diff(one.positions, axis=0)).max() < 0.0015


@pytest.mark.parametrize("together", [2, 3, 7])
def test_samples_of_one_time_keep_the_way_they_made(recorded: Recorded, together: int) -> None:
    """They came together, as after a packet that was held up."""
    sent = [
        each._replace(at_ms=each.at_ms // (10 * together) * 10 * together)
        for each in moving("one", 0, 100)
    ]
    (one,) = demonstrations_of(recorded(sent))
    assert len(one.time_s) == -(-100 // together)
    assert (np.diff(one.time_s) > 0).all()
    np.testing.assert_allclose(np.diff(one.positions[:-1, 0]), 0.001 * together, atol=1e-12)
    assert one.positions[-1, 0] - one.positions[0, 0] >= 0.099 - 0.001 * together


def test_samples_that_overtook_each_other_keep_the_way_they_made(recorded: Recorded) -> None:
    sent = moving("one", 0, 100)
    sent[50] = sent[50]._replace(at_ms=sent[49].at_ms)
    sent[20] = sent[20]._replace(at_ms=sent[20].at_ms + 15)
    content = recorded(sent)
    (one,) = demonstrations_of(content)
    assert (np.diff(one.time_s) > 0).all()
    assert one.positions[-1, 0] == pytest.approx(0.099)


# --- performances ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("taken_m", "performances"),
    [(0.0, 2), (0.009, 2), (0.02, 2), (0.055, 1), (0.099, 1)],
    ids=["where it began", "near", "less near", "between", "where it let go"],
)
def test_taking_hold_nearer_to_the_beginning_than_to_the_end_begins_anew(
    recorded: Recorded, taken_m: float, performances: int
) -> None:
    content = recorded(
        [*moving("one", 0, 100), *idle("one", 1000, 5, 0.1), *moving("one", 1100, 50, taken_m)]
    )
    assert len(performances_of(content)) == performances


def test_a_round_that_ends_where_it_began_is_a_performance_of_its_own(recorded: Recorded) -> None:
    """It lets go a little nearer to where it takes hold again than its beginning is."""
    out = moving("one", 0, 100)
    back = [each._replace(at_ms=1000 + 10 * k) for k, each in enumerate(reversed(out))]
    round_1 = [*out, *back[:-3], *idle("one", 2000, 5, 0.003)]
    again = [each._replace(at_ms=each.at_ms + 2100, x_m=each.x_m + 0.004) for each in out]
    assert len(performances_of(recorded([*round_1, *again]))) == 2
