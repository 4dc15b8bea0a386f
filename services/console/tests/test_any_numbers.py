"""Whatever numbers a message brings that the contract admits, the page is drawn."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from hmcs.bus.messages import (
    Belief,
    Evidence,
    FixtureState,
    Health,
    Motion,
    Outline,
    RobotState,
    TrainingProgress,
)
from hmcs.errors import UserError
from hmcs.recognition.model_file import load_model
from hmcs_console.seeing.listening import wrong_with
from hmcs_console.seeing.models import Models
from hmcs_console.seeing.seen import Seen
from hmcs_console.seeing.shelf import Shelf
from hmcs_console.seeing.step_evidence import usable
from hmcs_console.seeing.takes import Take, opened
from hmcs_console.view import View
from support.texts import EXAMPLE_OF

LOG = logging.getLogger("test")
EXTREME = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, 1e300, -1e300, 1.7e308, -1.7e308, 0.5, 1e9)
WHOLE = (0, 1, 41, 2**31 - 1, 2**62, 2**64 - 1)
NAMES = st.sampled_from(["", "free", "in", "line", "lines", "x"])
KINDS = (Belief, Evidence, FixtureState, RobotState, Motion, Health, Outline, TrainingProgress)


@st.composite
def changed(draw: Any, kind: Any) -> Any:
    """An example of a message with some numbers, arrays and texts put into it; None for none."""
    example = EXAMPLE_OF[kind]
    fields = dict(example)
    for name in draw(st.sets(st.sampled_from(sorted(fields)), max_size=4)):
        value = fields[name]
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            shape = draw(st.sampled_from([value.shape, (0,), (1,), (7,)]))
            count = int(np.prod(shape))
            numbers = draw(st.lists(st.sampled_from(EXTREME), min_size=count, max_size=count))
            with np.errstate(over="ignore"):
                fields[name] = np.array(numbers, dtype=value.dtype).reshape(shape)
        elif isinstance(value, np.ndarray):
            fields[name] = np.array([draw(st.integers(-(2**31), 2**31 - 1))] * len(value), "<i4")
        elif isinstance(value, bool):
            fields[name] = draw(st.booleans())
        elif isinstance(value, int):
            fields[name] = draw(st.sampled_from(WHOLE))
        elif isinstance(value, float):
            fields[name] = draw(st.sampled_from(EXTREME))
        elif isinstance(value, tuple) and value and isinstance(value[0], str):
            fields[name] = tuple(
                draw(st.lists(st.sampled_from(["free", "in", "x", ""]), max_size=3))
            )
        elif isinstance(value, str):
            fields[name] = draw(NAMES)
    try:
        return kind(**fields)
    except ValidationError:
        return None


class Nobody(SimpleNamespace):
    """Whoever is asked for things by the controls, and does none."""

    marks_by_pedal = True

    @property
    def recordings(self) -> Any:
        return self

    def __getattr__(self, _: str) -> Any:
        return lambda *_: None


@pytest.fixture
def view(model_file: Any) -> Iterator[View]:
    made = View(Models((load_model(model_file),), (), LOG), Shelf(()), None, "", Nobody(), 1.0, LOG)
    yield made
    made.page.close()


def keep(seen: Seen, said: Any) -> Take | None:
    """Take a message in as it is from the bus."""
    match said:
        case Belief() if not wrong_with(said):
            seen.on_belief(10.0, "lines", said)
        case Evidence() if usable(said):
            seen.evident("lines", said)
        case FixtureState():
            seen.fixture_changed(10.0, said)
        case RobotState():
            seen.robot_moved(10.0, said)
        case Motion():
            seen.hand_moved(said)
        case TrainingProgress():
            seen.training = said
        case Outline():
            try:
                return opened(Take(), said)
            except UserError as error:
                return Take(said=str(error))
    return None


@settings(
    max_examples=200,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(st.lists(st.sampled_from(KINDS).flatmap(changed), min_size=1, max_size=6))
def test_any_numbers_are_drawn(view: View, reported: list[Any]) -> None:
    seen = Seen(())
    take = Take()
    with warnings.catch_warnings():
        # Numbers that are larger than what draws them can hold are drawn somewhere.
        warnings.simplefilter("ignore", RuntimeWarning)
        for said in reported:
            take = keep(seen, said) or take
            seen.write_down(10.0)
        view._words_s = view._scene._trails_s = 0.0
        view.draw(seen.picture(10.0, "", None)._replace(take=take))
