"""Size and turn against dense least squares, and what a bank makes of them."""

import numpy as np
import pytest

from hmcs.motion.steps import steps_of
from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs.recognition.learning import learn
from hmcs.recognition.segment_filter import alignment
from hmcs.recognition.segment_filter.alignment import Alignment
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings
from hmcs.recognition.segment_filter.gestemes import GestemeBank

SIGMA = 0.16
ALIGNMENT = Alignment(SIGMA)
PHASES, GESTEMES, PAIRS = 7, 3, 4
LARGER, TURN_RAD = 1.25, np.radians(12.0)


def derivative(place):
    """∂x/∂θ of (1 + s)·m + ω × m at m, shape (D, 1 + R)."""
    if len(place) == 1:
        return place[:, None]
    if len(place) == 2:
        return np.array([[place[0], -place[1]], [place[1], place[0]]])
    x, y, z = place
    return np.array([[x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]])


def random_gestemes(axes, rng):
    """Means, variances equal in all positions, and all phases possible but the last of one."""
    means = rng.normal(size=(GESTEMES, PHASES, 2 * axes))
    variances = np.repeat(rng.uniform(0.01, 0.1, size=(GESTEMES, PHASES, 2)), axes, axis=2)
    possible = np.ones((GESTEMES, PHASES), dtype=bool)
    possible[1, -1] = False
    return means, variances, possible


def walked(axes, rng, count=12):
    """Every pair's places and phase probabilities step by step, and the belief after them."""
    means, variances, possible = random_gestemes(axes, rng)
    phases = alignment.phases_of(means, variances, possible, ALIGNMENT)
    gesteme = rng.integers(GESTEMES, size=PAIRS).astype(np.int32)
    places = rng.normal(size=(count, PAIRS, axes))
    shares = rng.dirichlet(np.full(PHASES, 0.3), size=(count, PAIRS))
    belief = alignment.as_learned(PAIRS, axes)
    for where, share in zip(places, shares, strict=True):
        belief = alignment.updated(phases, belief, gesteme, share, where)
    return means, variances, phases, gesteme, places, shares, belief


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_the_belief_is_the_dense_least_squares_solution(axes):
    rng = np.random.default_rng(axes)
    means, variances, _, gesteme, places, shares, belief = walked(axes, rng)
    for pair, g in enumerate(gesteme):
        turns = belief.turn.shape[1]
        rows, wanted = [np.eye(1 + turns) / SIGMA], [np.zeros(1 + turns)]
        for where, share in zip(places[:, pair], shares[:, pair], strict=True):
            for n in range(PHASES):
                place = means[g, n, :axes]
                root = np.sqrt(share[n] / variances[g, n, 0] / ALIGNMENT.temperature)
                rows.append(root * derivative(place))
                wanted.append(root * (where - place))
        theta = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=None)[0]
        ours = [belief.growth[pair], *belief.turn[pair]]
        np.testing.assert_allclose(ours, theta, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_a_fresh_pair_expects_every_size_and_turn_of_the_prior(axes):
    rng = np.random.default_rng(axes)
    means, variances, possible = random_gestemes(axes, rng)
    phases = alignment.phases_of(means, variances, possible, ALIGNMENT)
    gesteme = np.arange(GESTEMES, dtype=np.int32)
    where = rng.normal(size=(GESTEMES, axes))
    direction = rng.normal(size=axes)
    direction /= np.linalg.norm(direction)
    densities = alignment.log_densities(
        phases, alignment.as_learned(GESTEMES, axes), gesteme, where, direction
    )
    for g, n in np.ndindex(GESTEMES, PHASES):
        if not possible[g, n]:
            assert densities[g, n] == -np.inf
            continue
        place = means[g, n, :axes]
        moved = derivative(place)
        covariance = np.diag(variances[g, n, :axes]) + SIGMA**2 * moved @ moved.T
        error = where[g] - place
        expected = -0.5 * (
            error @ np.linalg.solve(covariance, error)
            + np.log(np.linalg.det(2.0 * np.pi * covariance))
        )
        expected += log_gaussians(
            means[g, n : n + 1, axes:], variances[g, n : n + 1, axes:] + SIGMA**2, direction[None]
        )[0, 0]
        assert densities[g, n] == pytest.approx(expected, rel=1e-10)


def test_in_the_plane_size_and_turn_are_exact():
    belief = alignment.as_learned(1, 2)._replace(
        growth=np.array([LARGER * np.cos(TURN_RAD) - 1.0]),
        turn=np.array([[LARGER * np.sin(TURN_RAD)]]),
    )
    c, s = np.cos(TURN_RAD), np.sin(TURN_RAD)
    rotation = np.array([[c, -s], [s, c]])
    points = np.array([[0.3, -0.4]])
    np.testing.assert_allclose(alignment.placed(belief, points), LARGER * points @ rotation.T)
    directions = np.array([[0.6, 0.8]])
    turned = alignment.turned(belief, directions)
    np.testing.assert_allclose(turned, directions @ rotation.T)
    np.testing.assert_allclose(alignment.turned(belief, turned, back=True), directions)


def test_turned_with_its_gesteme_a_motion_is_as_probable_as_it_was():
    rng = np.random.default_rng(6)
    means, variances, possible = random_gestemes(2, rng)
    phases = alignment.phases_of(means, variances, possible, ALIGNMENT)
    learned = alignment.as_learned(1, 2)._replace(information=np.array([1e12]))
    c, s = np.cos(TURN_RAD), np.sin(TURN_RAD)
    rotated = learned._replace(growth=np.array([c - 1.0]), turn=np.array([[s]]))
    rotation = np.array([[c, -s], [s, c]])
    gesteme, where = np.zeros(1, dtype=np.int32), rng.normal(size=(1, 2))
    direction = np.array([0.6, 0.8])
    np.testing.assert_allclose(
        alignment.log_densities(phases, rotated, gesteme, where @ rotation.T, rotation @ direction),
        alignment.log_densities(phases, learned, gesteme, where, direction),
        rtol=1e-6,
    )


def test_to_stand_still_has_no_direction_however_it_is_turned():
    belief = walked(3, np.random.default_rng(4))[-1]
    nowhere = np.zeros((PAIRS, 3))
    np.testing.assert_array_equal(alignment.turned(belief, nowhere, back=True), nowhere)


class Scene:
    """The gestemes `along` and `round`, in space or in the plane they lie in."""

    def __init__(self, model, task, performances, axes):
        p = model.knowledge.parameters
        seen = [*range(axes), *range(3, 3 + axes)]
        normals = p.normals[:, :, :axes]
        self.parameters = p._replace(
            means=p.means[:, :, seen],
            variances=p.variances[:, :, seen],
            ends=p.ends[:, :, :axes],
            normals=normals / np.linalg.norm(normals, axis=2, keepdims=True),
        )
        self.scoring = model.knowledge.scoring
        self.axes = range(axes)
        self.dead_zone_m = task.dead_zone_m
        self.performances = performances

    def bank(self, aligned, held=(0, 1), **scoring):
        scoring = self.scoring._replace(alignment=aligned, **scoring)
        return GestemeBank(self.parameters, scoring, self.axes, held)

    def steps(self, order, factor=1.0, turn_rad=0.0, seed=77):
        c, s = np.cos(turn_rad), np.sin(turn_rad)
        similar = factor * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return steps_of(self.performances(order, seed).positions @ similar.T, self.dead_zone_m)


@pytest.fixture(params=[2, 3], ids=["plane", "space"])
def scene(request, model, task, performances):
    return Scene(model, task, performances, request.param)


def of_pair(bank, steps, gesteme, start=0):
    """Total log ratio of a pair, and its size and turn after the last step."""
    total = 0.0
    for step in steps:
        evidence = bank.step(step)
        mine = (evidence.pair_gesteme == gesteme) & (evidence.pair_start == start)
        total += float(evidence.log_ratio[mine][0])
    belief = alignment.picked(bank.similarity, mine) if len(bank.similarity.growth) else None
    return total, belief


def test_a_larger_turned_gesteme_has_more_evidence_aligned_and_its_size_and_turn_are_found(scene):
    gains, found = [], []
    for seed in range(160, 170):
        steps = scene.steps(["round"], LARGER, TURN_RAD, seed)
        plain, _ = of_pair(scene.bank(Alignment(), prune_nats=np.inf), steps, 1)
        aligned, belief = of_pair(scene.bank(ALIGNMENT, prune_nats=np.inf), steps, 1)
        gains.append(aligned - plain)
        found.append([belief.growth[0], belief.turn[0, -1]])
    assert np.mean(gains) > 2.0
    # What is along the path may as well be another phase: the belief stays short of the truth.
    true = LARGER * np.array([np.cos(TURN_RAD), np.sin(TURN_RAD)]) - [1.0, 0.0]
    assert (np.mean(found, axis=0) > 0.5 * true).all()
    assert (np.mean(found, axis=0) < true).all()


def bits(evidence, gestemes):
    mine = np.isin(evidence.pair_gesteme, gestemes)
    fields = (evidence.pair_gesteme, evidence.pair_start, evidence.exit, evidence.log_ratio)
    return [field[mine].tobytes() for field in fields]


def test_an_aligned_gesteme_does_not_depend_on_what_else_is_held(scene):
    steps = scene.steps(["along", "round", "along"], LARGER, TURN_RAD)
    whole, alone = scene.bank(ALIGNMENT), scene.bank(ALIGNMENT, held=[1])
    for step in steps:
        assert bits(alone.step(step), [1]) == bits(whole.step(step), [1])


def test_aligned_gestemes_gained_by_replay_continue_as_if_always_held(scene):
    steps = scene.steps(["along", "round", "along"], LARGER, TURN_RAD)
    whole, half, fresh = (
        scene.bank(ALIGNMENT),
        scene.bank(ALIGNMENT, [1]),
        scene.bank(ALIGNMENT, [0]),
    )
    for step in steps[:20]:
        whole.step(step), half.step(step), fresh.step(step)
    grown = half.replaced(fresh, keep=[1])
    for step in steps[20:]:
        assert bits(grown.step(step), [0, 1]) == bits(whole.step(step), [0, 1])


def test_no_spread_is_no_alignment_to_the_bit(scene):
    steps = scene.steps(["along", "round"])
    one, other = scene.bank(Alignment()), scene.bank(Alignment(0.0, temperature=9.0))
    for step in steps:
        assert bits(one.step(step), [0, 1]) == bits(other.step(step), [0, 1])
    assert len(one.similarity.growth) == 0


def test_with_ever_less_spread_alignment_becomes_none(scene):
    plain, narrow = scene.bank(Alignment()), scene.bank(Alignment(1e-6))
    for step in scene.steps(["along", "round"]):
        one, other = plain.step(step), narrow.step(step)
        np.testing.assert_array_equal(other.pair_start, one.pair_start)
        np.testing.assert_allclose(other.log_ratio, one.log_ratio, atol=1e-5)
        np.testing.assert_allclose(other.exit, one.exit, atol=1e-5)


def test_a_model_aligns_where_its_learning_was_asked_to(task, performances):
    shown = [performances(["along", "round", "up"], seed) for seed in range(2)]
    assert learn(task, shown).knowledge.scoring.alignment.sigma == 0.0
    asked = learn(task, shown, LearningSettings(alignment_sigma=SIGMA))
    assert asked.knowledge.scoring.alignment == ALIGNMENT
