"""Recordings on the page: their labels as they are drawn, set, saved, and never lost unasked."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser
from numpy.testing import assert_allclose

from hmcs.bus.messages import ChangeRecording, Done, Outline, OutlineQuestion, SetLabels
from hmcs.bus.session import RequestRefusedError
from hmcs.recordings.stretches import LabelError
from hmcs_console.seeing.takes import (
    Take,
    bands,
    hidden,
    labeled,
    lines,
    opened,
    played_at,
    saved,
    saving,
    states_of,
    unlabeled,
)
from hmcs_console.shapes.palette import UNKNOWN, color_of
from hmcs_console.teaching.timeline import TakePath, Timeline
from support.outlines import STATES, outline


def take(**changed: Any) -> Take:
    return opened(Take(), outline())._replace(**changed)


# --- what is shown --------------------------------------------------------------------------------


def test_a_band_rises_where_its_label_begins_and_falls_where_it_ends() -> None:
    plotted = bands(take(), STATES)
    assert len(plotted) == 3 + len(STATES)
    assert len({len(column) for column in plotted}) == 1
    assert (np.diff(plotted[0]) > 0).all()
    free = plotted[3]
    assert_allclose(free[(plotted[0] >= 0) & (plotted[0] < 5)], 0.1)
    assert_allclose(free[(plotted[0] < 0) | (plotted[0] >= 5)], 0.0)
    assert_allclose(plotted[4], 0.0)


def test_speed_is_that_of_the_hand() -> None:
    plotted = bands(take(), STATES)
    assert_allclose(plotted[1], 0.1)


def test_a_recording_without_motion_is_plotted_all_the_same() -> None:
    nothing = opened(Take(), outline(time_s=np.zeros(0), position=np.zeros((0, 3))))
    assert "no motion" in nothing.said
    assert_allclose(bands(nothing, STATES)[1], 0.0)
    assert lines(nothing, STATES, np.zeros(3))[0][0].shape == (0, 2, 3)


def test_the_way_is_colored_by_its_labels_and_begins_where_it_is_laid() -> None:
    (pieces, colors), (chosen, _) = lines(
        take(chosen_s=(2.0, 3.0)), STATES, np.array([0.6, 0.0, 0.4])
    )
    assert_allclose(pieces[0, 0], [0.6, 0.0, 0.4])
    assert pieces.shape == colors.shape == (100, 2, 3)
    assert tuple(colors[0, 0]) == color_of("free", STATES)
    assert tuple(colors[-1, 1]) == UNKNOWN
    assert_allclose(chosen[:, 0, 0], np.arange(0.8, 0.9, 0.01), atol=1e-6)


def test_while_a_recording_is_played_a_ball_is_where_the_hand_was() -> None:
    shown, origin = take(playing_since_s=100.0), np.array([0.6, 0.0, 0.4])
    begin, later = (played_at(shown, origin, at_s) for at_s in (100.0, 102.0))
    assert begin is not None
    assert later is not None
    assert_allclose(begin, origin)
    way = shown.position[np.searchsorted(shown.time_s, shown.time_s[0] + 2.0)]
    assert_allclose(later, way - shown.position[0] + origin, atol=0.02)
    assert played_at(shown, origin, 1000.0) is None
    assert played_at(shown._replace(playing_since_s=None), origin, 100.0) is None


def test_labels_that_are_no_states_of_the_task_are_offered_and_drawn() -> None:
    shown = opened(Take(), outline(states=("s1",)))
    assert states_of(shown, STATES) == ("free", "in", "s1")
    assert len(bands(shown, states_of(shown, STATES))) == 6


# --- editing --------------------------------------------------------------------------------------


def test_a_label_takes_the_chosen_stretch_and_cuts_what_was_there() -> None:
    shown = labeled(take(chosen_s=(4.0, 8.0)), "in")
    asked = saving(shown)
    assert asked.recording == "two.mcap"
    assert asked.states == ("free", "in")
    assert_allclose(asked.begin_s, [0.0, 4.0])
    assert_allclose(asked.end_s, [4.0, 8.0])
    assert "not saved yet" in shown.said


def test_removing_leaves_the_rest() -> None:
    asked = saving(unlabeled(take(chosen_s=(1.0, 2.0))))
    assert_allclose(asked.begin_s, [0.0, 2.0])
    assert_allclose(asked.end_s, [1.0, 5.0])


def test_an_empty_stretch_cannot_be_labeled_and_says_so() -> None:
    before = take(chosen_s=(4.0, 4.0))
    shown = labeled(before, "in")
    assert "let it begin before it ends" in shown.said
    assert shown.labels == before.labels


def test_labels_that_were_not_saved_are_there_when_it_is_opened_again() -> None:
    edited = labeled(take(chosen_s=(4.0, 8.0)), "in")
    other = opened(edited, outline(recording="one.mcap"))
    assert [label.state for label in other.labels] == ["free"]
    again = opened(hidden(other), outline())
    assert [label.state for label in again.labels] == ["free", "in"]
    done = saved(again, saving(again), "2 labels written")
    assert done.said == "2 labels written"
    assert [label.state for label in opened(done, outline()).labels] == ["free"]


def test_what_was_set_while_saving_is_still_to_be_saved() -> None:
    edited = labeled(take(chosen_s=(4.0, 8.0)), "in")
    later = labeled(edited._replace(chosen_s=(8.0, 9.0)), "free")
    done = saved(later, saving(edited), "written")
    assert [label.state for label in opened(done, outline()).labels] == ["free", "in", "free"]


@pytest.mark.parametrize(
    "changed",
    [
        {"time_s": np.zeros(3)},
        {"states": ()},
        {"begin_s": np.array([0.0, 1.0]), "end_s": np.array([5.0, 6.0]), "states": ("a", "b")},
    ],
)
def test_an_outline_that_contradicts_itself_is_not_shown(changed: dict[str, Any]) -> None:
    with pytest.raises(LabelError):
        opened(Take(), outline(**changed))


# --- over the bus ---------------------------------------------------------------------------------


class Recorder:
    """One that has two recordings, and refuses to label one of them."""

    def __init__(self, bus: Any) -> None:
        self.asked: list[SetLabels] = []
        bus.answer("outline", OutlineQuestion, self.outline)
        bus.answer("set_labels", SetLabels, self.set_labels)
        bus.answer("change_recording", ChangeRecording, self.change)
        self.changes: list[ChangeRecording] = []
        bus.announce(bus.keys.presence("recorder", "x"))

    def outline(self, asked: OutlineQuestion) -> Outline:
        if asked.recording == "gone.mcap":
            raise RequestRefusedError("there is no recording 'gone.mcap'")
        return outline(recording=asked.recording or "two.mcap")

    def change(self, asked: ChangeRecording) -> Done:
        self.changes.append(asked)
        return Done(detail="changed")

    def set_labels(self, asked: SetLabels) -> Done:
        if asked.recording == "one.mcap":
            raise RequestRefusedError("one.mcap cannot be labeled")
        self.asked.append(asked)
        return Done(detail="labels written")


@pytest.fixture
def cell(make_cell: Callable[..., Any]) -> Any:
    made = make_cell()
    made.recorder = Recorder(made.other)
    made.until(lambda: any(m.service == "recorder" for m in made.service._seen.members), "it")
    return made


def test_a_recording_is_labeled_on_the_page(cell: Any) -> None:
    recordings = cell.service.recordings
    recordings.refresh()
    cell.until(lambda: recordings.take.name == "two.mcap", "the newest recording")
    recordings.choose(5.0, 9.0)
    recordings.label("in")
    recordings.save()
    cell.until(lambda: recordings.take.said == "labels written", "the answer")
    (asked,) = cell.recorder.asked
    assert asked.states == ("free", "in")
    recordings.hide()
    cell.until(lambda: not recordings.take.name, "nothing to be shown")


def test_what_a_recorder_refuses_is_said_and_nothing_is_lost(cell: Any) -> None:
    recordings = cell.service.recordings
    recordings.open("one.mcap")
    cell.until(lambda: recordings.take.name == "one.mcap", "the recording")
    recordings.label("in")
    recordings.save()
    cell.until(lambda: "one.mcap cannot be labeled" in recordings.take.said, "the refusal")
    recordings.open("gone.mcap")
    cell.until(lambda: "there is no recording" in recordings.take.said, "the refusal")
    assert recordings.take.name == "one.mcap"
    assert [label.state for label in recordings.take.labels] == ["in"]


def test_a_recording_is_renamed_noted_and_deleted_on_the_page(cell: Any) -> None:
    recordings = cell.service.recordings
    recordings.open("one.mcap")
    cell.until(lambda: recordings.take.name == "one.mcap", "the recording")
    recordings.label("in")
    recordings.note("slower")
    cell.until(lambda: recordings.take.note == "slower", "the note")
    assert recordings.take.name == "one.mcap"
    recordings.rename("slow")
    cell.until(lambda: not recordings.take.name, "nothing to be shown")
    assert recordings.take.said == "changed"
    assert "one.mcap" not in recordings.take.unsaved
    assert [(asked.change, asked.text) for asked in cell.recorder.changes] == [
        ("note", "slower"),
        ("rename", "slow"),
    ]


def test_without_a_recorder_the_page_says_what_is_missing(make_cell: Callable[..., Any]) -> None:
    cell = make_cell()
    recordings = cell.service.recordings
    recordings.refresh()
    cell.until(lambda: "no recorder is there" in recordings.take.said, "a hint")
    recordings.label("in")
    cell.until(lambda: "open a recording first" in recordings.take.said, "a hint")


# --- the controls ---------------------------------------------------------------------------------


MANAGING = ("play", "rename", "delete", "note", "segment")


class Asked(SimpleNamespace):
    """Whoever is asked for things by the controls."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[tuple[Any, ...]] = []
        for verb in ("open", "refresh", "hide", "choose", "label", "remove", "save", *MANAGING):
            setattr(self, verb, lambda *words, verb=verb: self.said.append((verb, *words)))


@pytest.fixture
def server() -> Any:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_drawing_asks_for_nothing_by_itself(server: Any) -> None:
    asked = Asked()
    timeline = Timeline(server.gui, asked, lambda _: None)
    path = TakePath(server.scene, np.zeros(3))
    shown = take()
    for drawn in (shown, labeled(shown, "in"), hidden(shown), shown._replace(chosen_s=(1.0, 2.0))):
        timeline.draw(drawn, STATES)
        path.draw(drawn, STATES, 0.0)
    assert asked.said == []


def test_controls_are_there_only_while_a_recording_is_shown(server: Any) -> None:
    timeline = Timeline(server.gui, Asked(), lambda _: None)
    path = TakePath(server.scene, np.zeros(3))

    def draw(shown: Take) -> tuple[bool, bool]:
        timeline.draw(shown, STATES)
        path.draw(shown, STATES, 0.0)
        return timeline._shown.visible, path._path.visible

    assert draw(Take()) == (False, False)
    assert draw(take()) == (True, True)
    assert timeline._choice.chosen == "two.mcap"
    assert timeline._state.offered == STATES
    assert draw(hidden(take())) == (False, False)
    assert timeline._choice.chosen == ""


def test_a_recording_is_deleted_at_the_second_press_and_of_that_recording_only(
    server: Any,
) -> None:
    asked = Asked()
    timeline = Timeline(server.gui, asked, lambda _: None)
    timeline.draw(take(), STATES)
    timeline._ask_to_delete()
    assert timeline._delete.label == "Delete two.mcap for ever"
    timeline.draw(opened(Take(), outline(recording="one.mcap")), STATES)
    assert timeline._delete.label == "Delete"
    timeline._ask_to_delete()
    assert asked.said == []
    timeline._ask_to_delete()
    assert asked.said == [("delete",)]


def test_the_slider_is_as_long_as_the_recording(server: Any) -> None:
    timeline = Timeline(server.gui, Asked(), lambda _: None)
    timeline.draw(take(), STATES)
    assert timeline._slider is not None
    assert (timeline._slider.min, timeline._slider.max) == (0.0, 10.0)
    timeline.draw(opened(Take(), outline(duration_s=30.0)), STATES)
    assert (timeline._slider.max, timeline._slider.value) == (30.0, (0.0, 30.0))
