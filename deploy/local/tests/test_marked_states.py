from __future__ import annotations

from typing import Any

import pytest

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Description, Envelope, Source
from hmcs.bus.session import Answer
from hmcs.errors import UserError
from hmcs_local.marking import _check_known


class Robots:
    """A bus on which robots say which states their task has; None: one that does not say it."""

    def __init__(self, *states: str | None) -> None:
        self.keys = Keys("cell")
        self._states = states

    def ask(self, key: str, _asked: Any, _reply: Any, timeout_s: float) -> list[Any]:
        assert key == self.keys.rpc("robot", "*", "describe")
        envelope = Envelope(source=Source(service="robot", instance="r", boot="b"), seq=0)
        return [Answer(envelope, description(names)) for names in self._states]


def description(states: str | None) -> Description:
    facts = {} if states is None else {"states": states}
    return Description(version="0", publishes=(), subscribes=(), answers=(), facts=facts)


@pytest.mark.parametrize("state", ["insert", "insert/push", ""])
def test_a_state_of_the_task_is_marked(state: str) -> None:
    _check_known(Robots("approach, insert"), state)  # type: ignore[arg-type]


def test_a_state_that_the_task_does_not_have_is_refused_with_the_nearest() -> None:
    with pytest.raises(UserError, match=r"unknown state 'insrt', did you mean insert\?"):
        _check_known(Robots("approach, insert"), "insrt")  # type: ignore[arg-type]


def test_of_several_robots_each_task_counts() -> None:
    _check_known(Robots("approach", "insert"), "insert")  # type: ignore[arg-type]


@pytest.mark.parametrize("robots", [(), (None,)])
def test_where_no_robot_says_its_states_any_is_marked(robots: tuple[None, ...]) -> None:
    _check_known(Robots(*robots), "anything")  # type: ignore[arg-type]
