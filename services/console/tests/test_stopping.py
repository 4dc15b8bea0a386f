"""Stop for everybody: over a real router, with robots that are made up."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hmcs.bus.keys import Member
from hmcs.bus.messages import Ask, Done, StopRequest
from hmcs.bus.session import RequestRefusedError
from hmcs_console.operating.handles import Grabbed
from hmcs_console.operating.stopping import MOST_ASKED, said

MakeCell = Callable[..., Any]
MakeProcess = Callable[..., Any]
HERE = np.array([0.6, 0.0, 0.5])


def grab(cell: Any, client: int = 1) -> None:
    cell.service.page.put(Grabbed(client, time.monotonic(), HERE))
    cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")


def stands(_: Ask) -> Done:
    return Done(detail="stands")


def refuses(_: Ask) -> Done:
    raise RequestRefusedError("no brakes")


def robot(make_process: MakeProcess, cell: Any, name: str, stop: Callable[[Ask], Done]) -> Any:
    return make_process(cell, "robot", name, {"stop": (Ask, stop)})


def stop_until(cell: Any, reported: Callable[[str], bool]) -> None:
    """Stop again and again, as one would until everybody is there, and has answered."""

    def stopped() -> bool:
        cell.service.stop()
        cell.wait(0.1)
        return reported(cell.service.answer)

    cell.until(stopped, "an answer to stop")


def test_stop_asks_every_robot_to_stand_and_tells_what_came_of_it(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell(lease_s=2.0)
    robot(make_process, cell, "one", stands)
    robot(make_process, cell, "two", refuses)
    stop_until(cell, lambda reported: "robot one stands" in reported and "no brakes" in reported)
    assert "robot two **may still move**: robot refused: no brakes" in cell.service.answer
    # Whether anybody holds a handle or not; and whoever does has let go.
    grab(cell)
    cell.service.stop()
    cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")


def test_stop_tells_where_no_robot_is_there(make_cell: MakeCell) -> None:
    cell = make_cell()
    stop_until(cell, lambda reported: "no robot is there" in reported)


def test_a_robot_that_gives_no_answer_may_still_move_which_is_reported_and_holds_nobody_up(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    ending = threading.Event()

    def hangs(_: Ask) -> Done:
        ending.wait(10.0)
        return Done(detail="late")

    robot(make_process, cell, "hung", hangs)
    robot(make_process, cell, "well", stands)
    stop_until(cell, lambda reported: "well stands" in reported and "hung is asked" in reported)
    cell.until(
        lambda: "robot hung **may still move**: robot gave no answer" in cell.service.answer,
        "what came of it",
    )
    ending.set()


def test_every_robot_is_asked_at_once_however_many_do_not_answer(
    make_cell: MakeCell, make_process: MakeProcess
) -> None:
    cell = make_cell()
    ending = threading.Event()
    asked: list[float] = []

    def hangs(_: Ask) -> Done:
        asked.append(time.monotonic())
        ending.wait(20.0)
        return Done(detail="late")

    names = [f"hung-{number}" for number in range(12)]
    for name in names:
        robot(make_process, cell, name, hangs)
    robot(make_process, cell, "well", stands)
    seen = cell.service._seen
    cell.until(lambda: len(seen.members) == 13, "all of them")
    cell.service.stop()
    cell.until(lambda: "robot well stands" in cell.service.answer, "the one that answers")
    # None of those that hang has given up yet.
    assert all(f"robot {name} is asked to stand" in cell.service.answer for name in names)
    cell.until(lambda: len(asked) == 12, "each to have been asked")
    cell.until(lambda: cell.service.answer.count("gave no answer") == 12, "what came of it")
    assert all(f"robot {name} **may still move**" in cell.service.answer for name in names)
    ending.set()


def test_whoever_hears_it_is_asked_to_stand_seen_or_not(make_cell: MakeCell) -> None:
    cell = make_cell()
    for number in range(2 * MOST_ASKED):
        cell.other.announce(cell.other.keys.presence("robot", f"a-ghost-{number}"))
    heard: list[StopRequest] = []
    keys = cell.other.keys
    cell.other.subscribe(StopRequest, keys.stop_request, lambda got: heard.append(got.body))
    cell.until(lambda: cell.service._stopping._requests.matching, "the console")
    cell.until(lambda: len(cell.service._seen.members) == 2 * MOST_ASKED, "ghosts")
    cell.service.stop()
    cell.until(lambda: heard, "the message")
    assert heard[0].reason == "Stop on the page of console x"
    cell.until(lambda: "is asked to stand" not in cell.service.answer, "what came of it")
    assert cell.service.answer.count("**may still move**") == 2 * MOST_ASKED
    assert cell.service.answer.count("not awaited") == MOST_ASKED


def test_what_came_of_a_stop_is_reported_robot_by_robot() -> None:
    reported = said({Member("robot", "a"): "", Member("robot", "b"): "stands"}).split("  \n")
    assert reported[1:] == ["robot a is asked to stand …", "robot b stands"]
