"""Gestemes and states found without labels; the curves are constructed, so the truth is known."""

from itertools import pairwise

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.operators import Operator, follow, joined
from hmcs.recognition.discovery.order_cuts import CutSettings
from hmcs.recognition.discovery.task_states import task_states
from hmcs.recognition.discovery.unlabeled import UnlabeledSettings, discover, labeled
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.segments import LearningError, labeled_steps
from hmcs_laboratory.agreement import adjusted_rand_index, boundaries_of

STEP_M = 0.05
FIVE = ("l1", "c1", "l2", "c1", "l3")


def line(x: float, y: float, z: float = 0.0) -> np.ndarray:
    return np.outer(np.linspace(0, 1, 41), [x, y, z])


def arc(radius_m: float, angle_rad: float, heading_rad: float) -> np.ndarray:
    s = np.linspace(0, angle_rad, 81)
    turned = heading_rad + s
    x, y = np.sin(turned) - np.sin(heading_rad), np.cos(heading_rad) - np.cos(turned)
    return radius_m * np.stack([x, y, 0 * s], axis=1)


CURVES = {
    "l1": line(1.0, 0.0),
    "c1": arc(0.35, 3.5, 2.4),
    "l2": line(0.3, 0.9),
    "l3": line(0.2, -0.9),
}
"""They follow one another with turns of more than θ_min, π/6."""


def exact(order=FIVE, curves=CURVES, step_m=STEP_M):
    """Positions on the curves themselves and the piece of each."""
    points, owners = joined([curves[name] for name in order], step_m)
    return points, np.array(owners)


def noisy(seed, order=FIVE, curves=CURVES, noise=0.1):
    points, owners = joined([curves[name] for name in order], STEP_M / 2)
    trace = follow(points, Operator(noise=noise), np.random.default_rng(seed), owners)
    return trace.positions, trace.segments


def as_demonstration(name, positions):
    return Demonstration(
        name, np.arange(float(len(positions))), positions, (None,) * len(positions)
    )


@pytest.fixture(scope="module")
def five():
    return [noisy(seed) for seed in range(5)]


@pytest.fixture(scope="module")
def found(five):
    return discover([positions for positions, _ in five])


def rotation(seed):
    turn, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return turn * np.sign(np.linalg.det(turn))


# Exact curves


@pytest.mark.parametrize(
    "order", [("l1", "l2"), ("l1", "c1"), ("c1", "l2", "l3"), FIVE], ids="-".join
)
def test_pieces_of_exact_curves_are_found_to_the_step(order):
    positions, truth = exact(order)
    result = discover([positions])
    assert len(result.states.gestemes) == len(order)
    assert np.abs(result.demonstrations[0].boundaries - boundaries_of(truth)).max() <= 1
    assert len(result.path_points) == len(set(order))


def test_a_smooth_passage_from_a_line_into_an_arc_is_found():
    positions, truth = exact(("l1", "arc"), {"l1": line(1, 0), "arc": arc(0.3, 3.0, 0.0)})
    (found_,) = discover([positions]).demonstrations
    assert len(found_.boundaries) == 1
    assert abs(found_.boundaries[0] - boundaries_of(truth)[0]) <= 2


def test_an_arc_in_space_is_one_gesteme():
    turn = rotation(3)
    curves = {"arc": CURVES["c1"] @ turn.T, "l": line(0.1, 0.2, 0.9)}
    positions, truth = exact(("arc", "l"), curves)
    (found_,) = discover([positions]).demonstrations
    assert len(found_.boundaries) == 1
    assert abs(found_.boundaries[0] - boundaries_of(truth)[0]) <= 1


def test_a_motion_without_any_break_is_one_gesteme_and_one_state():
    result = discover([exact(("c1",))[0]])
    assert result.states.gestemes.tolist() == [0]
    assert result.states.transition.tolist() == [[0.0]]
    assert not len(result.demonstrations[0].boundaries)


def stopping(curves, scale):
    """The curves in turn, each from rest to rest (minimum jerk) in 300 samples."""
    u = np.linspace(0, 1, 300)
    eased = u**3 * (10 - 15 * u + 6 * u**2)
    pieces, here = [np.zeros((1, 3))], np.zeros(3)
    for curve in curves:
        share = np.linspace(0, 1, len(curve))
        moved = np.stack([np.interp(eased, share, column) for column in curve.T], axis=1)
        pieces.append(here + scale * moved[1:])
        here = pieces[-1][-1]
    return as_demonstration(f"scale-{scale}", np.concatenate(pieces))


# Noisy demonstrations


def test_a_gesteme_performed_twice_is_one_gesteme_in_two_states(found):
    assert found.states.gestemes.tolist() == [0, 1, 2, 1, 3]
    assert found.states.starts.tolist() == [5, 0, 0, 0, 0]
    assert found.states.transition.tolist() == np.eye(5, k=1).tolist()
    assert len(found.path_points) == len(found.path_spreads) == 4


def test_labels_agree_with_the_true_ones(five, found):
    for (_, truth), own in zip(five, found.demonstrations, strict=True):
        assert np.abs(own.boundaries - boundaries_of(truth)).max() <= 3
        assert adjusted_rand_index(truth, own.states) > 0.85
        assert boundaries_of(own.states).tolist() == own.boundaries.tolist()


def test_mean_paths_are_the_curves_that_were_followed(found):
    for name, points in zip(("l1", "c1", "l2", "l3"), found.path_points, strict=True):
        # The hand cuts corners, and labels change where it is nearest to them.
        assert np.linalg.norm(points[-1] - CURVES[name][-1]) < 3 * STEP_M


def test_boundaries_that_all_show_are_supported_by_all(found):
    (support,) = found.supports
    assert support.shape == (4,)
    assert (support >= 0.5).all()
    assert not found.notes


def labels_of(result):
    return [own.states.tolist() for own in result.demonstrations]


@pytest.mark.parametrize("seed", range(3))
def test_turn_place_and_size_change_nothing(five, found, seed):
    rng = np.random.default_rng(seed)
    scale, place = 10.0 ** rng.uniform(-2, 2), rng.normal(size=3)
    moved = [scale * positions @ rotation(seed).T + place for positions, _ in five]
    result = discover(moved)
    assert labels_of(result) == labels_of(found)
    assert result.step_m == pytest.approx(scale * found.step_m)


def test_the_order_of_demonstrations_changes_nothing(five, found):
    order = [3, 0, 4, 2, 1]
    result = discover([five[k][0] for k in order])
    assert labels_of(result) == [labels_of(found)[k] for k in order]


def test_labels_that_are_there_are_not_looked_at(five, found):
    given = [
        as_demonstration(str(k), positions)._replace(states=("x",) * len(positions))
        for k, (positions, _) in enumerate(five)
    ]
    assert labels_of(discover(given)) == labels_of(found)


def test_demonstrations_of_different_orders_share_their_gestemes():
    curves = {"a": line(1, 0), "b": arc(0.3, 4.0, 1.5), "c": line(0.2, 1.0), "d": line(-1, 0.3)}
    orders = [("a", "b", "c", "d"), ("c", "a", "d", "b"), ("d", "c", "b", "a")]
    result = discover([exact(order, curves)[0] for order in orders])
    assert sorted(own.order for own in result.demonstrations) == [0, 1, 2]
    assert len(result.states.gestemes) == len(result.path_points) == 4
    assert any("3 different orders" in note for note in result.notes)
    named = {}
    for order, own in zip(orders, result.demonstrations, strict=True):
        pieces = own.gestemes[np.concatenate([[0], own.boundaries])]
        for name, gesteme in zip(order, pieces, strict=True):
            assert named.setdefault(name, gesteme) == gesteme


def test_stops_are_the_boundaries_where_the_hand_stops():
    """A corner passed at speed is part of a gesteme if the hand stops elsewhere."""
    curves = [exact(("l1", "l2"))[0], CURVES["l3"]]
    made = [stopping(curves, scale) for scale in (0.97, 1.0, 1.03)]
    for own in discover(made).demonstrations:
        assert len(own.boundaries) == 1
        assert np.linalg.norm(np.diff(made[0].positions[[300, own.boundaries[0]]], axis=0)) < STEP_M
    passed = discover(made, UnlabeledSettings(cut=CutSettings(stops=False)))
    assert all(len(own.boundaries) == 2 for own in passed.demonstrations)
    untimed = discover([each.positions for each in made])
    assert labels_of(untimed) == labels_of(passed)


# What is learned from it


def test_a_recognizer_learned_from_what_was_found_recognizes_a_fresh_performance(five, found, task):
    given = [as_demonstration(f"d{k}", positions) for k, (positions, _) in enumerate(five)]
    template = task.model_copy(update={"dead_zone_m": 0.02})
    made, demonstrations = labeled(found, given, template)
    assert [gesteme.name for gesteme in made.gestemes] == ["g1", "g2", "g3", "g4"]
    assert [(s.name, s.gestemes, s.next) for s in made.states] == [
        ("s1", ("g1",), {"s2": 1.0}),
        ("s2", ("g2",), {"s3": 1.0}),
        ("s3", ("g3",), {"s4": 1.0}),
        ("s4", ("g2",), {"s5": 1.0}),
        ("s5", ("g4",), {}),
    ]
    kept = ("name", "workspace", "robot", "dead_zone_m", "recognition")
    assert all(getattr(made, field) == getattr(template, field) for field in kept)
    recognizer = recognizer_of(learn(made, demonstrations))
    positions, truth = noisy(seed=77)
    fresh = as_demonstration("fresh", positions)._replace(
        states=tuple(f"s{state + 1}" for state in truth)
    )
    steps, states, _ = labeled_steps(made, fresh)
    believed = [int(recognizer.step(step).belief.states.argmax()) for step in steps]
    assert list(dict.fromkeys(believed)) == [0, 1, 2, 3, 4]
    assert np.mean(np.array(believed) == states) > 0.85


def test_demonstrations_other_than_those_it_was_found_in_are_refused(five, found, task):
    given = [as_demonstration(f"d{k}", positions) for k, (positions, _) in enumerate(five)]
    with pytest.raises(LearningError, match="give the same ones in the same order"):
        labeled(found, given[1:], task)


# States


@pytest.mark.parametrize(
    ("sequences", "states", "gestemes"),
    [
        ([[0, 1, 2, 1, 3]], [[0, 1, 2, 3, 4]], [0, 1, 2, 1, 3]),
        ([[0, 1, 2], [2, 0, 1]], [[0, 1, 2], [2, 0, 1]], [0, 1, 2]),
        ([[0, 1, 0, 1, 0], [0, 1]], [[0, 1, 0, 1, 0], [0, 1]], [0, 1]),
        ([[0, 1, 2, 0, 1, 2]], [[0, 1, 2, 0, 1, 2]], [0, 1, 2]),
        ([[0, 0]], [[0, 1]], [0, 0]),
    ],
    ids=["twice in a task", "any order", "rounds", "two rounds", "twice on end"],
)
def test_states_follow_from_the_order_of_gestemes(sequences, states, gestemes):
    found = task_states([np.array(own) for own in sequences])
    assert [own.tolist() for own in found.sequences] == states
    assert found.gestemes.tolist() == gestemes
    assert found.starts.sum() == len(sequences)
    counted = np.zeros_like(found.followed)
    for own in states:
        for before, after in pairwise(own):
            counted[before, after] += 1
    assert (found.followed == counted).all()


# Bad input


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], "no demonstrations to find gestemes in: give at least one"),
        ([np.zeros((1, 3))], r"1 sample\(s\), expected two at least"),
        ([np.zeros((9, 2))], r"shape \(9, 2\), expected \(T, 3\)"),
        ([np.zeros(9)], r"shape \(9,\), expected \(T, 3\)"),
        ([np.ones((9, 3))], "never moves"),
        ([line(1, 0), np.full((9, 3), np.nan)], "'demonstration 2': position 0 is .*mend"),
        ([line(1, 0), line(0.01, 0)], r"'demonstration 2' makes 1 step\(s\) .* it larger"),
    ],
    ids=["none", "one sample", "plane", "flat", "constant", "not finite", "short"],
)
def test_what_nothing_can_be_found_in_is_refused_with_what_to_do(given, message):
    with pytest.raises(LearningError, match=message) as raised:
        discover(given)
    assert isinstance(raised.value, UserError)


def test_the_same_demonstration_twice_counts_once_and_is_said_so(five, found):
    positions = [positions for positions, _ in five]
    result = discover([*positions, positions[0]])
    assert labels_of(result) == [*labels_of(found), labels_of(found)[0]]
    assert result.notes == (
        "'demonstration 6' is the same motion as 'demonstration 1': it counts once",
    )


def test_one_demonstration_alone_works_and_is_said_to_be_unsupported(five):
    result = discover([five[0][0]])
    assert len(result.demonstrations) == 1
    assert result.notes == (
        "'demonstration 1' is the only one of its order: no other demonstration supports its "
        "boundaries",
    )
