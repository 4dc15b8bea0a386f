"""What is seen of the model that is followed and of the loops, with the pieces of a real page."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs.bus.messages import (
    Belief,
    Envelope,
    Evidence,
    FixtureState,
    Motion,
    Origin,
    Source,
    Step,
    TrainingProgress,
)
from hmcs.bus.wire import encode
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.task import load_task, shipped_tasks
from hmcs_console.drawing.drawn_guides import DrawnGuides
from hmcs_console.seeing.glancing import MessageHeader, header_of
from hmcs_console.seeing.seen import Picture, Seen
from hmcs_console.serving.server import Server
from hmcs_console.telling import spoken_rules

MakeCell = Callable[..., Any]
LOG = logging.getLogger("test")
ORIGIN = Origin(boot="device", seq=7, captured_ns=1)
START = (0.6, 0.0, 0.5)


def fixture_state(**fields: Any) -> FixtureState:
    still = np.zeros(6)
    said: dict[str, Any] = {
        "law": "general",
        "model": "lines",
        "state": "in",
        "factor": 0.5,
        "compliance": 0.5,
        "preferred_direction": np.zeros(3),
        "progress": 0.5,
        "gesteme": "line",
        "guide_origin": np.array([0.1, 0.2, 0.3]),
        "off_guide_m": 0.01,
        "operator_twist": still,
        "command_twist": still,
        "wrench": still,
        "engaged": True,
        "reason": "guiding",
    }
    return FixtureState(**(said | fields))


def believed(**fields: Any) -> Belief:
    said: dict[str, Any] = {
        "model_hash": "h",
        "clock": "device",
        "step": 4,
        "states": ("free", "in"),
        "probabilities": np.array([0.25, 0.75]),
        "likely_gesteme": "line",
        "segment_start": 0,
    }
    return Belief(**(said | fields))


# --- guides of every state ------------------------------------------------------------------------


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server(logging.getLogger("test"))
    yield server
    server.stop()


@pytest.fixture
def known(model_file: Path) -> Model:
    return load_model(model_file)


def picture(fixture: FixtureState | None) -> Picture:
    seen = Seen(("free", "in"))
    if fixture is not None:
        seen.fixture_changed(10.0, fixture)
    return seen.picture(10.0, "", None)


def lines_of(guides: DrawnGuides) -> dict[str, Any]:
    return guides._lines


def test_every_states_guide_is_drawn_end_to_end_before_anything_is_done(
    server: Server, known: Model
) -> None:
    guides = DrawnGuides(server.scene)
    guides.draw(picture(None), known)
    lines = lines_of(guides)
    assert {state for state, line in lines.items() if line.visible} == {"free", "in"}
    assert_allclose(lines["free"].position, START)
    assert_allclose(lines["in"].position, (1.1, 0.0, 0.5))


def test_the_guide_that_leads_is_drawn_in_full_where_the_fixture_says(
    server: Server, known: Model
) -> None:
    guides = DrawnGuides(server.scene)
    guides.draw(picture(fixture_state(state="free")), known)
    lines = lines_of(guides)
    assert {state for state, line in lines.items() if line.visible} == {"in"}
    assert_allclose(lines["in"].position, (0.6, 0.2, 0.3))
    assert guides._lead.visible
    assert_allclose(guides._lead.position, (0.1, 0.2, 0.3))
    guides.draw(picture(None), known)
    assert not guides._lead.visible
    assert_allclose(lines["free"].position, (0.1, 0.2, 0.3))


def test_guides_go_with_the_model_that_is_no_longer_followed(server: Server, known: Model) -> None:
    guides = DrawnGuides(server.scene)
    guides.draw(picture(fixture_state()), known)
    guides.draw(picture(fixture_state()), None)
    assert not lines_of(guides)
    assert not guides._lead.visible


# --- rules of every state -------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_tasks())
def test_every_state_of_every_task_that_comes_along_has_a_row(name: str) -> None:
    task = load_task(name)
    table = spoken_rules.rules(task, task.states[-1].name)
    rows = [row for row in table.splitlines() if row.startswith("| ")][1:]
    assert len(rows) == len(task.states)
    assert {row.count("|") for row in rows} == {6}
    assert f"**{task.states[-1].name}**" in rows[-1]
    assert "**" not in rows[0]


def test_what_a_state_has_of_its_own_is_reported(known: Model) -> None:
    of_state = {
        "law": "thesis",
        "compliance": "fixed",
        "fixed_compliance": 0.25,
        "maximum_factor": 0.7,
        "plan": {"speed_m_s": 0.04},
        "shared": {"operator_axes": ["vz"]},
    }
    fields = known.task.model_dump(exclude_none=True)
    fields["states"][0]["fixture"] = of_state
    fields["states"][1]["fixture"]["target"] = {"position_m": [0.5, 0.0, 0.25]}
    free, inside = spoken_rules.rules(type(known.task).model_validate(fields), "").splitlines()[-2:]
    for part in ("thesis, fixed 0.25", "0.70", "none", "plan, 40 mm/s; vz shared"):
        assert part in free
    for part in ("50 → 10 mm", "to (0.500, 0.000, 0.250) m"):
        assert part in inside


def test_without_a_known_model_no_rules_are_reported() -> None:
    assert "not known" in spoken_rules.rules(None, "")


# --- messages at a glance -------------------------------------------------------------------------


def test_sender_and_cause_are_read_without_the_rest() -> None:
    envelope = Envelope(
        source=Source(service="robot", instance="r", boot="boot"), seq=3, origin=ORIGIN
    )
    step = Step(index=0, position=np.zeros(3), displacement=np.ones(3))
    assert header_of(encode(step, envelope)) == MessageHeader("boot", ("device", 7))
    assert header_of(encode(step, envelope.model_copy(update={"origin": None}))) == MessageHeader(
        "boot", None
    )


@pytest.mark.parametrize("payload", [b"", b"\xc1", b"\x93\x01\x02\x03", b"\x81\xa6origin\xc0"])
def test_what_is_no_message_has_neither(payload: bytes) -> None:
    assert header_of(payload) == MessageHeader("", None)


def test_every_message_counts_and_the_newest_is_kept(make_cell: MakeCell) -> None:
    cell = make_cell()
    for number in range(50):
        cell.move_robot(0.5 + 0.01 * number)
    cell.until(lambda: cell.bus.counters.received["robot_state"] >= 50, "all of them")
    robot = cell.service._seen.picture(time.monotonic(), "", None).robot
    assert robot is not None
    assert_allclose(robot.tool_position[0], 0.99)
    assert cell.bus.counters.lost["robot_state"] == 0


def test_what_is_no_robots_state_is_refused(make_cell: MakeCell) -> None:
    cell = make_cell()
    stranger = cell.other.publisher(Motion, cell.other.keys.robot_state)
    cell.until(lambda: stranger.matching, "the console")
    stranger.put(Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True))
    cell.until(lambda: cell.bus.counters.refused["robot_state"], "a refusal")


# --- the loops ------------------------------------------------------------------------------------


def test_hops_of_both_loops_are_written_down(make_cell: MakeCell) -> None:
    cell = make_cell()
    keys, other = cell.other.keys, cell.other
    motions = other.publisher(Motion, keys.motion)
    fixtures = other.publisher(FixtureState, keys.fixture_state)
    steps, beliefs = other.publisher(Step, keys.step), other.publisher(Belief, keys.belief("lines"))
    for publisher in (motions, fixtures, steps, beliefs):
        cell.until(lambda publisher=publisher: publisher.matching, "the console")
    motions.put(Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True), ORIGIN)
    fixtures.put(fixture_state(), ORIGIN)
    cell.move_robot(0.5, ORIGIN)
    steps.put(Step(index=4, position=np.zeros(3), displacement=np.ones(3)), ORIGIN)
    cell.until(lambda: cell.bus.counters.received["fixture_state"], "the fixture")
    cell.until(lambda: cell.service._seen.active(time.monotonic()) == "lines", "who is followed")
    beliefs.put(believed(), ORIGIN)
    wanted = {"input → fixture", "fixture → robot", "step → belief"}

    def reported() -> set[str]:
        rows = cell.service._seen.picture(time.monotonic(), "", None).rows
        return wanted & set(rows[-1].numbers) if rows else set()

    cell.until(lambda: reported() == wanted, "hops")


def test_a_belief_comes_with_the_evidence_it_stands_on(make_cell: MakeCell) -> None:
    cell = make_cell()
    other = cell.other
    reported = other.publisher(Evidence, other.keys.evidence("lines", "x"))
    beliefs = other.publisher(Belief, other.keys.belief("lines"))
    for publisher in (reported, beliefs):
        cell.until(lambda publisher=publisher: publisher.matching, "the console")
    evidence = Evidence(
        model_hash="h",
        clock="device",
        step=4,
        gestemes=("line",),
        pair_gesteme=np.zeros(1, dtype=np.int32),
        pair_start=np.zeros(1, dtype=np.int32),
        exit=np.zeros(1, dtype=np.float32),
        log_ratio=np.full(1, 0.5, dtype=np.float32),
    )
    reported.put(evidence.model_copy(update={"pair_start": np.zeros(2, dtype=np.int32)}))
    reported.put(evidence)
    beliefs.put(believed())

    def seen() -> Picture:
        return cell.service._seen.picture(time.monotonic(), "", None)

    cell.until(lambda: seen().belief is not None and seen().evidence, "both")
    assert [each.gestemes for each in seen().evidence] == [("line",)]
    assert cell.bus.counters.refused["evidence"] == 1


def test_the_guides_of_a_model_that_was_trained_meanwhile_are_drawn(
    make_cell: MakeCell, model_file: Path, known: Model
) -> None:
    cell = make_cell()
    other = cell.other
    trained = other.publisher(TrainingProgress, other.keys.training)
    beliefs = other.publisher(Belief, other.keys.belief("lines"))
    for publisher in (trained, beliefs):
        cell.until(lambda publisher=publisher: publisher.matching, "the console")
    for path in ("/where/only/the/trainer/is.hmcs", str(model_file)):
        trained.put(
            TrainingProgress(model="lines", stage="done", detail="learned", share=1.0, path=path)
        )
    beliefs.put(believed(model_hash=known.hash))
    guides = cell.service._view._scene._guides
    cell.until(lambda: set(lines_of(guides)) == {"free", "in"}, "the guides")
