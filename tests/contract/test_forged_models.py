"""Whatever numbers a model file holds: it is refused, or its recognizer's beliefs are beliefs.

A checksum says that a file is as it was written, not who wrote it: each file here has a right one.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.motion.steps import Step
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import ModelFileError, check_model, load_model, save_model
from hmcs.recognition.registry import kinds, recognizer_of
from hmcs.recognition.serialization import to_arrays
from support.lessons import ROUND, lesson_task, performed, steps_performed

NAMES = [kind.name for kind in kinds()]
NUMBERS = [0.0, -1.0, 1.0, 2.0, 1e-320, 1e-12, 1e12, 1e200, -1e200, np.nan, np.inf, -np.inf, 0.5]


@cache
def taught(name: str) -> Model:
    return learn(lesson_task(), [performed(seed) for seed in range(3)], recognizer=name)


@cache
def motion() -> tuple[Step, ...]:
    return tuple(steps_performed(100, ROUND))


def leaves(value: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The ways to all arrays, numbers and names in knowledge."""
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return [found for f in value._fields for found in leaves(getattr(value, f), (*way, f))]
    if isinstance(value, tuple):
        return [found for k, item in enumerate(value) for found in leaves(item, (*way, k))]
    return [way]


def at(value: Any, way: tuple[Any, ...]) -> Any:
    for step in way:
        value = getattr(value, step) if isinstance(step, str) else value[step]
    return value


def replaced(value: Any, way: tuple[Any, ...], new: Any) -> Any:
    if not way:
        return new
    first, rest = way[0], way[1:]
    if isinstance(first, str):
        return value._replace(**{first: replaced(getattr(value, first), rest, new)})
    return (*value[:first], replaced(value[first], rest, new), *value[first + 1 :])


def forged_array(array: np.ndarray, data: st.DataObject) -> np.ndarray:
    how = data.draw(st.sampled_from(["entry", "all", "row", "shape", "kind", "scaled", "shuffled"]))
    if how == "kind":
        return array.astype(data.draw(st.sampled_from(["f4", "i4", "i8", "u1", ">f8", "?"])))
    if how == "shape":
        shapes = [array[:-1], array[..., None], array.ravel(), array[:0], array.T]
        return np.array(data.draw(st.sampled_from(shapes)))
    changed = array.astype(float)
    if how == "scaled":
        changed *= data.draw(st.sampled_from([-1.0, 2.0, 1e-6, 1e6, 1e150]))
    elif how == "shuffled":
        changed = changed.ravel()[::-1].reshape(changed.shape)
    elif how == "all":
        changed[...] = data.draw(st.sampled_from(NUMBERS))
    elif changed.size:
        place = data.draw(st.integers(0, changed.size - 1))
        if how == "row" and changed.ndim:
            changed[place % len(changed)] = data.draw(st.sampled_from(NUMBERS))
        else:
            changed.flat[place] = data.draw(st.sampled_from(NUMBERS))
    with np.errstate(invalid="ignore"):
        return changed.astype(array.dtype)


def forged(value: Any, data: st.DataObject) -> Any:
    if isinstance(value, np.ndarray):
        return forged_array(value, data)
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return data.draw(st.sampled_from([0, -1, 1, 2, 10**6, 2**40, 2**62]))
    if isinstance(value, float):
        return data.draw(st.sampled_from(NUMBERS))
    if isinstance(value, str):
        return data.draw(st.sampled_from(["", "turn", "force", "network", "given", "never", "x"]))
    return None


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_forged_model_is_refused_or_believes_in_probabilities(
    name: str, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    model = taught(name)
    way = data.draw(st.sampled_from(leaves(model.knowledge)))
    knowledge = replaced(model.knowledge, way, forged(at(model.knowledge, way), data))
    path = tmp_path_factory.getbasetemp() / f"{name}.hmcs"
    try:
        save_model(model._replace(knowledge=knowledge), path)
        loaded = load_model(path)
    except ModelFileError:
        return
    recognizer = recognizer_of(loaded)
    for step in motion():
        recognition = recognizer.step(step)
        belief = recognition.belief
        assert belief.states.min() >= 0
        np.testing.assert_allclose(belief.states.sum() + belief.unknown, 1.0, atol=1e-6)
        assert np.isfinite([belief.log_likelihood, recognition.mean_log_likelihood]).all(), way


@pytest.mark.parametrize("name", NAMES)
def test_what_is_learned_is_a_model_that_is_read(name: str, tmp_path: Path) -> None:
    model = taught(name)
    check_model(model)
    loaded = load_model(save_and_name(model, tmp_path / "m.hmcs"))
    ours, theirs = to_arrays(model.knowledge), to_arrays(loaded.knowledge)
    assert ours.plain == theirs.plain
    assert all((ours.arrays[key] == theirs.arrays[key]).all() for key in ours.arrays)


def save_and_name(model: Model, path: Path) -> Path:
    save_model(model, path)
    return path


GUIDES = {
    "a point that is none": (lambda p: np.where(np.arange(len(p))[:, None] == 3, np.nan, p), None),
    "a path that stays": (np.zeros_like, None),
    "one point": (lambda p: p[:1], None),
    "a plane": (lambda p: p[:, :2], None),
    "a spread below zero": (None, lambda s: -1.0 - s),
    "a spread too many": (None, lambda s: np.append(s, 0.0)),
    "whole numbers": (lambda p: p.astype(int), None),
    "far beyond the earth": (lambda p: 1e200 * p, None),
}


@pytest.mark.parametrize(("points", "spread"), GUIDES.values(), ids=GUIDES)
def test_a_guide_that_is_none_is_refused(points: Any, spread: Any, tmp_path: Path) -> None:
    model = taught(NAMES[0])
    change = points or (lambda p: p)
    paths = (change(model.path_points[0]), *model.path_points[1:])
    beside = (spread or (lambda s: s))(model.path_spreads[0])
    forged_model = model._replace(path_points=paths, path_spreads=(beside, *model.path_spreads[1:]))
    with pytest.raises(ModelFileError, match=r"guide\.(path|spread)"):
        load_model(save_and_name(forged_model, tmp_path / "m.hmcs"))


@pytest.mark.parametrize("turns", [np.zeros((5, 4)), np.ones((5, 4)), np.eye(4)[3:], np.ones(4)])
def test_turns_that_are_none_are_refused(turns: np.ndarray, tmp_path: Path) -> None:
    model = taught(NAMES[0])
    forged_model = model._replace(path_turns=(turns, *model.path_turns[1:]))
    with pytest.raises(ModelFileError, match=r"guide\.turn"):
        load_model(save_and_name(forged_model, tmp_path / "m.hmcs"))
