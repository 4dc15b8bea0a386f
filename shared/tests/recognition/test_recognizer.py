"""A guarded recognizer is shown steps only, and one failure does not silence it."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.motion.steps import Step, steps_of_demonstration
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import BadStepError, Guarded, Recognition, TaskBelief
from hmcs.recognition.registry import recognizer_of

STATES = 3


def step_at(index: int, **changed: object) -> Step:
    return Step(index, np.zeros(3), np.ones(3))._replace(**changed)  # type: ignore[arg-type]


class Sure:
    """Believes in a state, and fails at some steps."""

    def __init__(self, state: int, fails_at: tuple[int, ...] = (), unknown: float = 0.0) -> None:
        self.state, self.fails_at, self.unknown = state, fails_at, unknown

    def step(self, step: Step) -> Recognition:
        if step.index in self.fails_at:
            raise ZeroDivisionError("one bad moment")
        states = np.eye(STATES)[self.state]
        return Recognition(TaskBelief(step.index, states, self.unknown, 0, 0, 0.0, ()), 0.0, False)


def believed(guarded: Guarded, index: int) -> int:
    return int(guarded.step(step_at(index)).belief.states.argmax())


def test_after_a_failure_another_recognizer_goes_on_with_the_next_step() -> None:
    reported: list[str] = []
    guarded = Guarded(Sure(0, fails_at=(5,)), lambda: Sure(1), reported.append)
    assert [believed(guarded, t) for t in range(5)] == [0] * 5
    with pytest.raises(ZeroDivisionError, match="one bad moment"):
        guarded.step(step_at(5))
    assert not reported
    assert [believed(guarded, t) for t in range(6, 9)] == [1] * 3
    assert reported == [
        "the recognizer failed (step 5: ZeroDivisionError('one bad moment')): it begins anew with "
        "step 6"
    ]


def test_the_step_after_a_failure_may_be_any() -> None:
    guarded = Guarded(Sure(0, fails_at=(3,)), lambda: Sure(1), lambda _: None)
    for index, failing in ((3, True), (40, False), (41, False)):
        if failing:
            with pytest.raises(ZeroDivisionError):
                guarded.step(step_at(index))
        else:
            assert believed(guarded, index) == 1
    with pytest.raises(BadStepError, match="step 43 came, expected 42"):
        guarded.step(step_at(43))


def test_without_another_one_the_same_recognizer_goes_on() -> None:
    guarded = Guarded(Sure(2, fails_at=(1,)), tell=lambda _: None)
    with pytest.raises(ZeroDivisionError):
        guarded.step(step_at(1))
    assert believed(guarded, 2) == 2


def test_one_that_fails_at_every_step_is_reported_once_and_made_anew_each_time() -> None:
    reported, made = list[str](), list[Sure]()

    def anew() -> Sure:
        made.append(Sure(0, fails_at=tuple(range(8))))
        return made[-1]

    guarded = Guarded(anew(), anew, reported.append)
    for t in range(8):
        with pytest.raises(ZeroDivisionError):
            guarded.step(step_at(t))
    assert believed(guarded, 8) == 0
    assert len(made) == 9
    assert len(reported) == 1


def test_where_no_other_can_be_made_it_is_tried_again() -> None:
    tries = list[int]()

    def anew() -> Sure:
        tries.append(1)
        if len(tries) == 1:
            raise MemoryError
        return Sure(1)

    guarded = Guarded(Sure(0, fails_at=(0,)), anew, lambda _: None)
    with pytest.raises(ZeroDivisionError):
        guarded.step(step_at(0))
    with pytest.raises(MemoryError):
        guarded.step(step_at(1))
    assert believed(guarded, 2) == 1


@pytest.mark.parametrize("unknown", [np.nan, 1.0, -1.0])
def test_a_belief_that_is_none_counts_as_a_failure(unknown: float) -> None:
    guarded = Guarded(Sure(0, unknown=unknown), lambda: Sure(1), lambda _: None)
    with pytest.raises(FloatingPointError, match="sum to"):
        guarded.step(step_at(0))
    assert believed(guarded, 1) == 1


@pytest.mark.parametrize(
    "changed",
    [
        {"position": np.array([0.0, np.nan, 0.0])},
        {"displacement": np.zeros(2)},
        {"orientation": np.zeros(3)},
        {"wrench": np.full(6, np.inf)},
    ],
)
def test_what_is_no_step_is_refused_and_changes_nothing(changed: dict[str, object]) -> None:
    guarded = Guarded(Sure(0), lambda: Sure(1))
    assert believed(guarded, 0) == 0
    with pytest.raises(BadStepError, match=next(iter(changed))):
        guarded.step(step_at(1, **changed))
    assert believed(guarded, 1) == 0


def test_a_real_recognizer_that_failed_finds_its_place_in_the_task_again(
    model: Model, performances, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    steps = steps_of_demonstration(performances(["along", "round", "up"], 50), 0.01)
    recognizer = recognizer_of(model)
    half = len(steps) // 2
    for step in steps[:half]:
        recognizer.step(step)
    with monkeypatch.context() as broken:
        broken.setattr(
            "hmcs.recognition.segment_filter.gestemes.exit_probability", lambda *_: 1 / 0
        )
        with pytest.raises(ZeroDivisionError):
            recognizer.step(steps[half])
    beliefs = [recognizer.step(step).belief for step in steps[half + 1 :]]
    assert "begins anew" in caplog.text
    assert model.state_names[int(beliefs[-1].states.argmax())] == "rise"
