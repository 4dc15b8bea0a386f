"""Chains: one hand, no jumps, every label where its own demonstration begins."""

import numpy as np
import pytest

from hmcs.motion.chains import chained, closed
from hmcs.motion.demonstrations import Demonstration, DemonstrationError


def arc(name: str, turn: float, count: int = 50, pace: float = 1.0) -> Demonstration:
    angle = turn * np.linspace(0, 1, count) ** pace
    positions = np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    return Demonstration(name, np.linspace(3.0, 4.0, count), positions, (name,) * count)


def test_each_demonstration_begins_where_the_one_before_ended():
    pieces = [arc("a", 1.0), arc("b", -2.0), arc("a", 0.5)]
    start = np.array([0.1, 0.2, 0.3])
    chain = chained("chain", pieces, start)
    np.testing.assert_allclose(chain.positions[0], start)
    net = sum(piece.positions[-1] - piece.positions[0] for piece in pieces)
    np.testing.assert_allclose(chain.positions[-1] - start, net)
    steps = np.linalg.norm(np.diff(chain.positions, axis=0), axis=1)
    longest = max(np.linalg.norm(np.diff(p.positions, axis=0), axis=1).max() for p in pieces)
    assert steps.max() <= longest * (1 + 1e-9)


def test_time_rises_and_labels_begin_with_their_own_demonstration():
    chain = chained("chain", [arc("a", 1.0), arc("b", -2.0)], np.zeros(3))
    assert (np.diff(chain.time_s) > 0).all()
    assert chain.time_s[0] == 0.0
    assert chain.time_s[-1] == pytest.approx(2.0)
    first_b = chain.states.index("b")
    np.testing.assert_allclose(chain.positions[first_b], arc("a", 1.0).positions[-1])
    assert len(chain.states) == len(chain.time_s) == len(chain.positions) == 99


def test_nothing_cannot_be_chained():
    with pytest.raises(ValueError, match="no demonstrations"):
        chained("none", [], np.zeros(3))


@pytest.mark.parametrize("pace", [1.0, 2.0], ids=["even", "ever faster"])
def test_a_closed_demonstration_ends_where_it_began_and_is_bent_evenly(pace):
    open_one = arc("a", 1.5, pace=pace)
    ring = closed(open_one)
    np.testing.assert_allclose(ring.positions[0], open_one.positions[0])
    np.testing.assert_allclose(ring.positions[-1], open_one.positions[0], atol=1e-12)
    bent = np.diff(ring.positions - open_one.positions, axis=0)
    pieces = np.linalg.norm(np.diff(open_one.positions, axis=0), axis=1)
    np.testing.assert_allclose(bent / pieces[:, None], bent[:1] / pieces[0] * np.ones((49, 1)))


def test_a_demonstration_that_never_moves_cannot_be_closed():
    still = arc("a", 1.0)._replace(positions=np.zeros((50, 3)))
    with pytest.raises(ValueError, match="never moves"):
        closed(still)


def felt(name: str, turn: float) -> Demonstration:
    rng = np.random.default_rng(len(name))
    quaternions = rng.normal(size=(50, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    wrenches = rng.normal(size=(50, 6))
    return arc(name, turn)._replace(orientations=quaternions, wrenches=wrenches)


def test_orientations_and_wrenches_go_along_with_their_own_samples():
    pieces = [felt("a", 1.0), felt("bb", -2.0)]
    chain = closed(chained("chain", pieces, np.zeros(3)))
    for sense in ("orientations", "wrenches"):
        kept, own = getattr(chain, sense), [getattr(piece, sense) for piece in pieces]
        assert len(kept) == len(chain.time_s)
        np.testing.assert_array_equal(kept[:49], own[0][:-1])
        np.testing.assert_array_equal(kept[49:], own[1])


@pytest.mark.parametrize("sense", ["orientations", "wrenches"])
def test_a_sense_that_only_some_of_a_chain_have_is_refused_and_the_lacking_one_named(sense):
    with pytest.raises(DemonstrationError, match=f"^second: has no {sense}, but others"):
        chained("c", [felt("a", 1.0), felt("second", 1.0)._replace(**{sense: None})], np.zeros(3))
