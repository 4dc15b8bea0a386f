"""Topologies are Markov chains with the zeros they promise, and refuse to be anything else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recognition.hmm.topologies import (
    TopologyError,
    fully_connected,
    left_right,
    start_anywhere,
    start_in,
)

inside = st.floats(0.01, 0.49)


@given(states=st.integers(1, 8), epsilon=inside, other=inside)
@settings(max_examples=25)
def test_every_row_of_every_topology_sums_to_one(states, epsilon, other):
    for transition in (
        fully_connected(states, other),
        left_right(states, epsilon, skip=other),
        start_in(states)[None],
        start_anywhere(states)[None],
    ):
        assert (transition >= 0).all()
        np.testing.assert_allclose(transition.sum(axis=1), 1.0)


def test_fully_connected_is_the_matrix_of_the_text():
    transition = fully_connected(4)
    np.testing.assert_allclose(np.diag(transition), 0.7)
    np.testing.assert_allclose(transition[~np.eye(4, dtype=bool)], 0.1)


def test_left_right_only_stays_or_goes_on():
    np.testing.assert_allclose(
        left_right(3, 0.2), [[0.8, 0.2, 0.0], [0.0, 0.8, 0.2], [0.0, 0.0, 1.0]]
    )


def test_skips_share_what_goes_on_where_there_is_a_state_to_skip():
    np.testing.assert_allclose(
        left_right(3, 0.2, skip=0.25), [[0.8, 0.15, 0.05], [0.0, 0.8, 0.2], [0.0, 0.0, 1.0]]
    )


def test_a_chain_that_is_left_lacks_epsilon_in_its_last_row():
    np.testing.assert_allclose(left_right(3, 0.2, leaves=True)[-1], [0.0, 0.0, 0.8])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: fully_connected(0), "at least one"),
        (lambda: fully_connected(3, 1.2), "stay is 1.2"),
        (lambda: fully_connected(3, float("nan")), "stay is nan"),
        (lambda: left_right(3, 0.0), "epsilon is 0.0"),
        (lambda: left_right(3, 1.0), "epsilon is 1.0"),
        (lambda: left_right(3, 0.2, skip=-0.1), "skip is -0.1"),
        (lambda: start_in(3, 3), "first state 3 is not one of 0 to 2"),
        (lambda: start_anywhere(-1), "at least one"),
    ],
)
def test_nonsense_is_refused_with_its_value(make, says):
    with pytest.raises(TopologyError, match=says) as raised:
        make()
    assert isinstance(raised.value, UserError)
