"""What a model finds in a recording: asked for, compared with the labels, and drawn beside them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import viser

from hmcs.bus.messages import OutlineQuestion, Segmentation, SegmentQuestion
from hmcs.bus.session import RequestRefusedError
from hmcs.palette import state_color
from hmcs.recordings.stretches import LabelError
from hmcs_console.seeing.found import MOST_SEGMENTS, agreement, with_found
from hmcs_console.seeing.shelf import Shelved
from hmcs_console.seeing.takes import Take, opened
from hmcs_console.teaching.parts import Parts, agreed, learned
from hmcs_console.teaching.strips import strips, ticks
from hmcs_console.telling.words import training
from support.outlines import STATES, outline

MODEL = Shelved("first", "hash-first", "segment-filter", ("two.mcap",), "first")
OTHER = Shelved("second", "hash-second", "lhmm", ("two.mcap",))


def said(**changed: Any) -> Segmentation:
    """Found: `free` up to 4 s, `in` up to 9 s, then unknown."""
    reported = {
        "recording": "two.mcap",
        "model": "first",
        "begin_s": np.array([0.0, 4.0, 9.0]),
        "end_s": np.array([4.0, 9.0, 10.0]),
        "states": ("free", "in", ""),
        "probability": np.array([0.9, 0.8, 0.7]),
    }
    return Segmentation(**(reported | changed))


def found(**changed: Any) -> Take:
    return with_found(opened(Take(), outline()), said(**changed))


def drawn(take: Take) -> str:
    assert take.found is not None
    return strips(take, take.found, STATES)


# --- what is known --------------------------------------------------------------------------------


def test_how_far_a_model_agrees_is_counted_over_the_labeled_time() -> None:
    assert agreement(found()) == pytest.approx(0.8)
    assert "80 %" in agreed(found()) or "80%" in agreed(found())
    assert agreement(found()._replace(labels=())) is None
    assert agreement(opened(Take(), outline())) is None
    assert agreement(found(states=("free/line", "in", ""))) == pytest.approx(0.8)


@pytest.mark.parametrize(
    "changed",
    [
        {"states": ("free", "in")},
        {"begin_s": np.array([0.0, 3.0, 9.0])},
        {"begin_s": np.array([4.0, 4.0, 9.0])},
        {"end_s": np.array([4.0, 9.0, 1e8])},
        {
            "begin_s": np.arange(MOST_SEGMENTS + 1.0),
            "end_s": np.arange(1.0, MOST_SEGMENTS + 2.0),
            "states": ("in",) * (MOST_SEGMENTS + 1),
            "probability": np.ones(MOST_SEGMENTS + 1),
        },
        {
            "begin_s": np.arange(200.0),
            "end_s": np.arange(1.0, 201.0),
            "states": tuple(map(str, range(200))),
            "probability": np.ones(200),
        },
    ],
)
def test_what_contradicts_itself_or_cannot_be_drawn_is_not_shown(changed: dict[str, Any]) -> None:
    with pytest.raises(LabelError):
        found(**changed)


def test_what_was_found_goes_with_its_recording() -> None:
    assert opened(found(), outline()).found is not None
    assert opened(found(), outline(recording="one.mcap")).found is None


# --- how it is drawn ------------------------------------------------------------------------------


def boxes(html: str, hint: str) -> list[tuple[float, float, str]]:
    """Begin, width and color of those whose hint begins so."""
    pattern = rf'<rect x="([\d.]+)" y="\d+" width="([\d.]+)" [^>]*fill="([^"]+)"><title>{hint}'
    return [(float(x), float(width), fill) for x, width, fill in re.findall(pattern, html)]


def test_both_strips_have_the_colors_of_the_states_over_one_axis_of_time() -> None:
    html = drawn(found())
    label, part = boxes(html, "free,")
    assert label[2] == part[2] == state_color(0).lower()
    assert label[0] == part[0]
    assert part[1] / label[1] == pytest.approx(0.8, abs=0.01)
    ((begins, _, color),) = boxes(html, "in,")
    assert color == state_color(1).lower()
    assert begins == pytest.approx(part[0] + part[1], abs=0.02)
    ((_, _, unknown),) = boxes(html, "unknown,")
    assert unknown == "url(#hmcs-unknown)"
    for text in ("labels", "found by first", "time, s", ">free<", ">in<", "unknown", "90%"):
        assert text.replace(">", "").replace("<", "") in html


def test_states_of_another_task_have_colors_of_their_own() -> None:
    take = found(states=("s1", "s2", ""))
    ((_, _, first),), ((_, _, second),) = boxes(drawn(take), "s1,"), boxes(drawn(take), "s2,")
    assert len({first, second, state_color(0).lower(), state_color(1).lower()}) == 4


@pytest.mark.parametrize("duration_s", [0.004, 0.9, 1.0, 3.7, 10.0, 59.0, 3600.0, 9e6])
def test_an_axis_has_a_few_round_times_within_the_recording(duration_s: float) -> None:
    at_s = ticks(duration_s)
    assert 2 <= len(at_s) <= 8
    assert at_s[0] == 0.0
    assert at_s[-1] <= duration_s * (1 + 1e-9)
    step = at_s[1] - at_s[0]
    assert f"{step:e}"[0] in "125"


def test_a_recording_of_no_length_is_drawn_all_the_same() -> None:
    assert "labels" in drawn(found()._replace(duration_s=0.0, labels=()))


# --- the controls ---------------------------------------------------------------------------------


class Finder:
    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []

    def segment(self, model: str, model_hash: str) -> None:
        self.asked.append((model, model_hash))


@pytest.fixture
def server() -> Any:
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_the_active_model_is_chosen_until_somebody_chooses_another(server: Any) -> None:
    finder = Finder()
    parts, take = Parts(server.gui, finder), opened(Take(), outline())
    parts._find()
    assert finder.asked == []
    parts.draw(take, STATES, (OTHER, MODEL))
    assert parts._choice.chosen == "second"
    parts.draw(take, STATES, (MODEL, OTHER))
    parts._find()
    parts._choice.choose("second")
    parts._choose("second")
    parts.draw(take, STATES, (Shelved("third", "hash-third", "", ()), MODEL, OTHER))
    parts._find()
    assert finder.asked == [("first", "hash-first"), ("second", "hash-second")]


def test_strips_are_there_once_something_was_found(server: Any) -> None:
    parts = Parts(server.gui, Finder())
    parts.draw(opened(Take(), outline()), STATES, (MODEL,))
    assert not parts._strips.visible
    assert "Learned from it: **first**" in parts._learned.content
    parts.draw(found(), STATES, (MODEL,))
    assert parts._strips.visible
    assert "found by first" in parts._strips.content
    parts.draw(opened(found(), outline(recording="one.mcap")), STATES, (MODEL,))
    assert not parts._strips.visible
    assert not parts._learned.visible


def test_a_model_with_a_report_leads_to_it_and_one_without_is_named() -> None:
    text = learned((MODEL, OTHER))
    assert '<a href="/reports/first.html" target="_blank"' in text
    assert text.endswith("**second**")


def test_what_was_trained_leads_to_its_report_where_the_page_serves_it() -> None:
    progress: Any = type(
        "Progress",
        (),
        {
            **{"model": "first", "stage": "done", "detail": "ok", "path": "/m/first.hmcs"},
            "report": "/m/first.html",
        },
    )
    assert '<a href="/reports/first.html"' in training(progress, (OTHER, MODEL))
    assert "<a " not in training(progress, (OTHER,))
    assert "<a " not in training(progress, (MODEL._replace(report=""),))


# --- over the bus ---------------------------------------------------------------------------------


class Others:
    """A recorder with two recordings, and a trainer that finds parts in one of them."""

    def __init__(self, make_process: Callable[..., Any], cell: Any) -> None:
        self.asked: list[SegmentQuestion] = []
        make_process(
            cell,
            *("recorder", "r"),
            {"outline": (OutlineQuestion, lambda ask: outline(recording=ask.recording))},
        )
        make_process(cell, "trainer", "t", {"segment": (SegmentQuestion, self.segment)})

    def segment(self, asked: SegmentQuestion) -> Segmentation:
        self.asked.append(asked)
        if asked.model == "fourier":
            raise RequestRefusedError("the recognizer has no offline segmentation")
        return said()


def test_the_parts_of_the_recording_that_is_shown_are_asked_of_the_trainer(
    make_cell: Callable[..., Any], make_process: Callable[..., Any]
) -> None:
    cell = make_cell()
    others = Others(make_process, cell)
    recordings, members = cell.service.recordings, cell.service._seen.members
    cell.until(lambda: {each.service for each in members} >= {"recorder", "trainer"}, "them")
    recordings.segment("first", "hash")
    cell.until(lambda: "open a recording first" in recordings.take.said, "a hint")
    recordings.open("two.mcap")
    cell.until(lambda: recordings.take.name == "two.mcap", "the recording")
    recordings.segment("fourier", "hash")
    cell.until(lambda: "no offline segmentation" in recordings.take.said, "the refusal")
    assert recordings.take.found is None
    recordings.segment("first", "hash")
    cell.until(lambda: recordings.take.found is not None, "the parts")
    assert recordings.take.found.model == "first"
    assert others.asked[-1] == SegmentQuestion(
        recording="/takes/two.mcap", model="first", model_hash="hash"
    )


def test_without_a_trainer_the_page_says_what_is_missing(make_cell: Callable[..., Any]) -> None:
    cell = make_cell()
    recordings = cell.service.recordings
    recordings.segment("first", "hash")
    cell.until(lambda: "no trainer is there" in recordings.take.said, "a hint")
