"""Names that anybody may show on the bus: what is none is refused, counted, and ends nothing."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from hmcs.bus.keys import Member
from hmcs.bus.messages import Belief, Envelope, Evidence, Source
from hmcs.bus.wire import encode
from hmcs_console.seeing.listening import wrong_with
from hmcs_console.seeing.presence import MOST_TOKENS, REFUSED
from hmcs_console.seeing.seen import MOST_RECOGNIZERS

MakeCell = Callable[..., Any]
NO_NAMES = (
    "evil name",
    "<img src=x onerror=alert(1)>",
    "\x1b[2J",
    "\u202eevil",
    "y" * 400,
    "-x",
    ".",
    "..",
    "ünïcode",
    "a&b",
)


def belief(**fields: Any) -> Belief:
    said: dict[str, Any] = {
        "model_hash": "h",
        "clock": "c",
        "step": 0,
        "states": ("free", "in"),
        "probabilities": np.array([0.25, 0.75]),
        "likely_gesteme": "line",
        "segment_start": 0,
    }
    return Belief(**(said | fields))


def put(cell: Any, key: str, body: Any, service: str = "s", instance: str = "i") -> None:
    """Publish what a process of any name says, on any key."""
    source = Source(service=service, instance=instance, boot="b")
    cell.other._session.put(key, encode(body, Envelope(source=source, seq=0)))


def key_of(cell: Any, *chunks: str) -> str:
    return "/".join(["hmcs/@v1", cell.bus.keys.cell, *chunks])


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_process_without_a_name_is_refused_and_counted_and_ends_nothing(
    make_cell: MakeCell, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    cell = make_cell()
    for chunks in ((name, "x"), ("robot", name), (name, name)):
        cell.other.announce(key_of(cell, "presence", *chunks))
    cell.other.announce(cell.other.keys.presence("robot", "fine"))
    cell.until(lambda: Member("robot", "fine") in cell.service._seen.members, "one with a name")
    assert cell.service._seen.members == {Member("robot", "fine")}
    assert cell.bus.counters.refused[REFUSED] == 3
    reported = [record for record in caplog.records if "refused" in record.getMessage()]
    assert len(reported) == 1
    assert cell.service.health()[0]


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_recognizer_without_a_name_is_refused_and_counted(make_cell: MakeCell, name: str) -> None:
    cell = make_cell()
    for chunks in ((name, "task_hmm", "x"), ("lines", name, "x"), ("lines", "task_hmm", name)):
        model, service, instance = chunks
        cell.other.announce(key_of(cell, "model", model, "member", service, instance))
    cell.until(lambda: cell.bus.counters.refused[REFUSED] == 3, "refusals")
    put(cell, key_of(cell, "model", name, "belief", "x"), belief())
    cell.until(lambda: cell.bus.counters.refused["belief"], "a refusal")
    evidence = Evidence(
        model_hash="h",
        clock="c",
        step=0,
        gestemes=(),
        pair_gesteme=np.zeros(0, dtype="<i4"),
        pair_start=np.zeros(0, dtype="<i4"),
        exit=np.zeros(0, dtype="<f4"),
        log_ratio=np.zeros(0, dtype="<f4"),
    )
    put(cell, key_of(cell, "model", name, "evidence", "x"), evidence)
    cell.until(lambda: cell.bus.counters.refused["evidence"], "a refusal")
    assert cell.service._seen.picture(0.0, "", None).recognizers == ()
    assert not cell.service._seen.runners.run("lines", set())


def test_a_token_that_goes_again_is_forgotten(make_cell: MakeCell) -> None:
    cell = make_cell()
    seen = cell.service._seen
    tokens = [
        cell.other.announce(cell.other.keys.presence("robot", "one")),
        cell.other.announce(cell.other.keys.member("lines", "task_hmm", "t")),
        cell.other.announce(key_of(cell, "presence", "robot", "evil name")),
    ]
    cell.until(lambda: seen.members and seen.runners.run("lines", set()), "tokens")
    for token in tokens:
        token.withdraw()
    cell.until(lambda: not seen.members and not seen.runners.run("lines", set()), "none")
    assert cell.bus.counters.refused[REFUSED] >= 1


def test_so_many_processes_are_known_and_no_more(make_cell: MakeCell) -> None:
    cell = make_cell()
    for number in range(MOST_TOKENS + 20):
        cell.other.announce(cell.other.keys.presence("ghost", f"g{number}"))
        cell.other.announce(cell.other.keys.member(f"m{number}", "ghost", "g"))
    cell.until(lambda: cell.bus.counters.refused[REFUSED] >= 40, "refusals")
    assert len(cell.service._seen.members) == MOST_TOKENS
    assert len(cell.service._seen.runners._members) == MOST_TOKENS


def test_so_many_recognizers_are_heard_and_no_more(make_cell: MakeCell) -> None:
    cell = make_cell()
    numbers = count()

    def refused() -> bool:
        # One after another: of many at once a busy machine may lose some.
        put(cell, cell.bus.keys.belief(f"made-up-{next(numbers)}", "x"), belief())
        return cell.bus.counters.refused["belief"] >= 2 * MOST_RECOGNIZERS

    cell.until(refused, "refusals")
    assert len(cell.service._seen.picture(0.0, "", None).recognizers) == MOST_RECOGNIZERS


@pytest.mark.parametrize(
    ("states", "why"),
    [
        (("in", "in"), "twice"),
        (tuple(f"s{number}" for number in range(300)), "more than"),
    ],
)
def test_a_belief_that_cannot_be_drawn_is_refused(
    make_cell: MakeCell, states: tuple[str, ...], why: str
) -> None:
    cell = make_cell()
    said = belief(states=states, probabilities=np.full(len(states), 1 / len(states)))
    assert why in wrong_with(said)
    put(cell, cell.bus.keys.belief("lines", "x"), said)
    cell.until(lambda: cell.bus.counters.refused["belief"], "a refusal")


def test_who_published_a_belief_runs_its_recognizer_as_long_as_it_is_there(
    make_cell: MakeCell,
) -> None:
    cell = make_cell()
    seen = cell.service._seen
    token = cell.other.announce(cell.other.keys.presence("own_recognizer", "o"))
    put(cell, cell.bus.keys.belief("lines", "o"), belief(), "own_recognizer", "o")
    cell.until(lambda: seen.runners.run("lines", seen.members), "who runs it")
    token.withdraw()
    cell.until(lambda: not seen.runners.run("lines", seen.members), "nobody")
