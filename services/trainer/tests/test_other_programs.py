"""Learning from recordings of other programs as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hmcs.recordings.foreign.choices import choices_of
from hmcs_trainer.references import read_sources
from hmcs_trainer.training import train
from support import foreign_files as made
from support.lessons import performed


def bag_of_lesson(folder: Path, seed: int) -> Path:
    """The labels of a lesson as buttons, its way as poses."""
    shown = performed(seed)
    names = [state for state, _ in shown.stretches if state is not None]
    sent: list[made.Sent] = []
    last = None
    for at_s, position, state in zip(shown.time_s, shown.positions, shown.states, strict=True):
        ns = made.BEGUN_NS + round(1e9 * float(at_s))
        if state != last and state is not None:
            pressed = [int(k == names.index(state)) for k in range(len(names))]
            sent.append(("/joy", ns, made.joy(made.ROS2, ns, pressed)))
        last = state
        sent.append(("/tool", ns, made.pose_stamped(made.ROS2, ns, position)))
    return made.write_bag2(folder, sent)


def test_a_bag_with_marks_is_what_a_csv_with_labels_is(tmp_path: Path) -> None:
    shown = performed(1)
    names = list(dict.fromkeys(state for state in shown.states if state is not None))
    bag = bag_of_lesson(tmp_path / "b", 1)
    marks = ",".join(f"{k}={name}" for k, name in enumerate(names))
    (source,) = read_sources([str(bag)], None, choices=choices_of(marks=marks))
    (read,) = source.demonstrations
    np.testing.assert_array_equal(read.positions, shown.positions)
    np.testing.assert_allclose(read.time_s, shown.time_s - shown.time_s[0], atol=1e-9)
    assert read.states == shown.states
    assert any("motion of /tool" in note for note in source.notes)


def test_states_found_in_a_bag_are_not_written_beside_it(tmp_path: Path) -> None:
    bags = [str(bag_of_lesson(tmp_path / name, seed)) for name, seed in (("a", 1), ("b", 2))]
    before = sorted(tmp_path.iterdir())
    heard: list[str] = []
    out = tmp_path / "out"
    out.mkdir()
    train(
        "human-shapes", bags, out / "m.hmcs", find_states=True, accept_implausible=True,
        progress=heard.append,
    )  # fmt: skip
    assert sum("labels are not written beside it" in each for each in heard) == 2
    assert sorted(tmp_path.iterdir()) == [*before, out]
