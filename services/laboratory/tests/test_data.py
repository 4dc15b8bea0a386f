"""Data: a set holds what its settings say, and nothing is learned from that is tested."""

from itertools import groupby, pairwise

import numpy as np
import pytest

from hmcs.motion.lasa import drawings
from hmcs.motion.references import turn_rad
from hmcs_laboratory.data.drawings import equal_steps, left_out, resampled
from hmcs_laboratory.data.drawn_tasks import any_order, fixed_order
from hmcs_laboratory.data.gestemes import performed, random_references
from hmcs_laboratory.data.hands import CurveSettings
from hmcs_laboratory.data.synthetic_tasks import (
    FIVE_STATES,
    TRAINED_ORDER,
    UNSEEN_ORDER,
    TaskSettings,
    five_states,
    line_task,
    of_other_sizes,
    six_segments,
)


def runs(values):
    return [key for key, _ in groupby(values)]


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("kind", ["line", "circle", "mixed"])
def test_a_hand_without_noise_stays_on_its_gesteme(kind, dimensions):
    settings = CurveSettings(kind=kind, dimensions=dimensions)
    rng = np.random.default_rng(2)
    curves = random_references(settings.references, 4, rng)
    made = performed(curves, settings.operator(0.0), training=1, test=1, rng=rng)
    for curve, (motion,) in zip(curves, made.training, strict=True):
        assert curve.shape[1] == motion.shape[1] == dimensions
        distances = np.linalg.norm(motion[:, None] - curve[None], axis=2).min(axis=1)
        assert distances.max() < settings.look_ahead_m
        steps = np.linalg.norm(np.diff(motion, axis=0), axis=1)
        np.testing.assert_allclose(steps, settings.step_m)


def test_fewer_gestemes_and_fewer_examples_are_the_first_of_more():
    settings = CurveSettings()
    curves = random_references(settings.references, 5, np.random.default_rng(1))
    operator = settings.operator(0.2)
    few, many = (
        performed(part, operator, training=3, test=2, rng=np.random.default_rng(8))
        for part in (curves[:2], curves)
    )
    first = many.first(gestemes=2, training=1)
    for ours, theirs in zip(first.test, few.test, strict=True):
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(a, b)
    assert [len(own) for own in first.training] == [1, 1]
    np.testing.assert_array_equal(first.training[1][0], few.training[1][0])


def test_five_states_come_in_turn_with_one_arc_twice():
    data = five_states(
        TaskSettings(demonstrations=2, performances=2), 0.15, np.random.default_rng(3)
    )
    assert [state.gestemes[0] for state in data.task.states] == list(FIVE_STATES)
    assert [gesteme.name for gesteme in data.task.gestemes] == ["l1", "c1", "l2", "l3"]
    assert list(data.gesteme_of_state) == [0, 1, 2, 1, 3]
    for demonstration in data.demonstrations:
        assert runs(demonstration.states) == ["S1", "S2", "S3", "S4", "S5"]
    for performance in data.performances:
        assert runs(performance.states) == [0, 1, 2, 3, 4]
        assert len(performance.states) == len(performance.steps)
    for before, after in pairwise(FIVE_STATES):
        assert turn_rad(data.references[before], data.references[after]) >= np.pi / 6


@pytest.mark.parametrize("dimensions", [2, 3])
def test_of_other_sizes_and_turns_each_segment_keeps_its_own_within_bounds(dimensions):
    settings = TaskSettings(demonstrations=1, performances=12, dimensions=dimensions)
    rng = np.random.default_rng(5)
    data = five_states(settings, 0.0, rng)
    other = of_other_sizes(data, settings, 0.0, 0.5, np.radians(15.0), rng)
    assert other.demonstrations is data.demonstrations
    line = data.references["l1"][-1]
    length = np.linalg.norm(line)
    factors, cosines = [], []
    for performance in other.performances:
        first = np.array([s.displacement for s in performance.steps])[performance.states == 0]
        factors.append(len(first) * settings.step_m / length)
        cosines.append(first[0] @ line / np.linalg.norm(first[0]) / length)
    slack = 4 * settings.step_m / length
    assert 0.5 - slack <= min(factors) < 0.9 < 1.1 < max(factors) <= 1.5 + slack
    assert np.cos(np.radians(15.0)) - 1e-9 <= min(cosines) < np.cos(np.radians(5.0))


def test_steps_are_the_samples_of_the_hand_or_made_by_the_dead_zone():
    few = {"demonstrations": 1, "performances": 1}
    samples = five_states(TaskSettings(**few), 0.0, np.random.default_rng(3))
    lengths = [np.linalg.norm(step.displacement) for step in samples.performances[0].steps]
    np.testing.assert_allclose(lengths, 0.05)
    settings = TaskSettings(**few, samples_per_step=50, dead_zone_m=0.05)
    zoned = five_states(settings, 0.3, np.random.default_rng(3))
    lengths = [np.linalg.norm(step.displacement) for step in zoned.performances[0].steps]
    assert min(lengths) >= 0.05
    assert np.median(lengths) < 0.055


def test_a_mark_stands_where_the_operator_begins_a_segment():
    settings = TaskSettings(demonstrations=1, performances=1)
    (performance,) = five_states(settings, 0.1, np.random.default_rng(4)).performances
    marked = [t for t, step in enumerate(performance.steps) if step.mark]
    switches = np.flatnonzero(np.diff(performance.states, prepend=-1))
    assert len(marked) == len(switches) == 5
    assert np.abs(np.array(marked) - switches).max() <= 1
    assert not any(step.mark for step in performance.unmarked().steps)


def test_the_unseen_order_is_performed_with_the_gestemes_learned():
    settings = TaskSettings(demonstrations=2, performances=2)
    trained, unseen = six_segments(settings, 0.1, np.random.default_rng(5))
    assert trained.demonstrations is unseen.demonstrations
    names = [gesteme.name for gesteme in trained.task.gestemes]
    for data, order in ((trained, TRAINED_ORDER), (unseen, UNSEEN_ORDER)):
        for performance in data.performances:
            gestemes = runs(data.gesteme_of_state[performance.states])
            assert [names[g] for g in gestemes] == list(order)


def test_lines_of_chapter_3_lie_in_space_each_a_state():
    settings = TaskSettings(dimensions=3, demonstrations=2, performances=1)
    data = line_task(settings, 4, 0.1, np.random.default_rng(6))
    assert len(data.task.states) == 4
    assert data.task.recognition.axes == ("x", "y", "z")
    for line in data.references.values():
        assert np.linalg.matrix_rank(line - line[0], tol=1e-9) == 1
    assert (np.ptp(data.demonstrations[0].positions, axis=0) > 0.05).all()


def test_equal_steps_are_equal_and_stay_on_the_path():
    drawing = drawings("Sine")[0].positions
    points = equal_steps(drawing, 0.002)
    np.testing.assert_array_equal(points[0], drawing[0])
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= 0.002 + 1e-9
    assert np.linalg.norm(points[:, None] - drawing[None], axis=2).min(axis=1).max() < 0.001
    with pytest.raises(ValueError, match="not two steps"):
        equal_steps(drawing, 1.0)


def test_the_drawing_left_out_is_not_among_those_learned_from():
    data = left_out(0.004, 6, np.random.default_rng(9), names=["Sine", "Angle"])
    for name, taught, tested in zip(("Sine", "Angle"), data.training, data.test, strict=True):
        together = {id(drawing) for drawing in (*taught, *tested)}
        assert together == {id(drawing) for drawing in resampled(name, 0.004)}
        assert (len(taught), len(tested)) == (6, 1)


@pytest.mark.parametrize(
    "made",
    [
        lambda rng: fixed_order(4, 3, 0.003, rng),
        lambda rng: any_order(6, 4, 3, 0.003, rng),
    ],
)
def test_stitched_tasks_are_performed_with_drawings_left_out(made):
    data = made(np.random.default_rng(11))
    count = len(data.task.states)
    names = [demonstration.name for demonstration in data.demonstrations]
    assert len(set(names)) == len(names) == 4 * count
    (performance,) = data.performances
    order = runs(performance.states)
    assert len(order) == 3 * count
    for k in range(3):
        assert sorted(order[k * count : (k + 1) * count]) == list(range(count))
    ends = [step.position + step.displacement for step in performance.steps]
    begins = [step.position for step in performance.steps]
    np.testing.assert_array_equal(ends[:-1], begins[1:])
