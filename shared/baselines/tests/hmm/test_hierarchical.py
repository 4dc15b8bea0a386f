"""Flattened trees against walking every way control can take through the tree."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.emissions import Discrete
from hmcs.recognition.hmm.inference import forward, log_likelihood
from hmcs.recognition.hmm.model import posterior, validate
from hmcs_baselines.hmm.hierarchical import (
    HierarchyError,
    Internal,
    Production,
    flattened,
    internal,
    summed,
)
from hmcs_baselines.hmm.markov import MarkovModelError


def random_tree(rng, depth, name="root"):
    """An unbalanced tree: production states stand beside internal ones, calls may end anywhere."""
    count = int(rng.integers(1, 4 if depth > 1 else 3))
    deep = rng.integers(count)
    children = tuple(
        random_tree(rng, depth - 1, f"{name}{c}")
        if depth > 1 and (c == deep or rng.random() < 0.3)
        else Production(f"{name}{c}")
        for c in range(count)
    )
    rows = rng.dirichlet(np.full(count + 1, 0.8), size=count)
    return internal(name, children, rng.dirichlet(np.ones(count)), rows[:, :-1], rows[:, -1])


def random_emission(rng, states):
    return Discrete(rng.dirichlet(np.ones(3), size=states))


def leaves(node, above=()):
    for child in node.children:
        path = (*above, node.name)
        if isinstance(child, Internal):
            yield from leaves(child, path)
        else:
            yield (*path, child.name)


def descend(child, stack):
    """Every vertical way from a child called to a production state: (call stack, probability)."""
    if isinstance(child, Production):
        yield stack, 1.0
        return
    for c, below in enumerate(child.children):
        for deeper, p in descend(below, [*stack, (child, c)]):
            yield deeper, child.entry[c] * p


def onward(stack):
    """Every way from a production state to the next: (call stack, probability); [] is the end."""
    if not stack:
        yield [], 1.0
        return
    *above, (node, c) = stack
    for s, sibling in enumerate(node.children):
        for deeper, p in descend(sibling, [*above, (node, s)]):
            yield deeper, node.transition[c, s] * p
    for deeper, p in onward(above):
        yield deeper, node.ending[c] * p


def production_of(stack):
    node, c = stack[-1]
    return (*[n.name for n, _ in stack], node.children[c].name)


def walks(root, likelihood, t=0, stack=None):
    """Every walk of control that emits all observations: (production states, stacks, p)."""
    ways = descend(root, []) if stack is None else onward(stack)
    for reached, p in ways:
        if not reached or p == 0:
            continue
        here = production_of(reached)
        joint = p * likelihood[here][t]
        if t == len(likelihood[here]) - 1:
            yield (here,), reached, joint
        else:
            for rest, last, q in walks(root, likelihood, t + 1, reached):
                yield (here, *rest), last, joint * q


@given(seed=st.integers(0, 10_000), depth=st.integers(1, 3), steps=st.integers(1, 3))
@settings(max_examples=20)
def test_the_flattened_model_equals_the_sum_over_every_walk_of_control(seed, depth, steps):
    rng = np.random.default_rng(seed)
    root = random_tree(rng, depth)
    paths = tuple(leaves(root))
    emission = random_emission(rng, len(paths))
    observations = rng.integers(3, size=steps)
    likelihood = dict(zip(paths, np.exp(emission.log_likelihood(observations)).T, strict=True))

    flat = flattened(root, emission)
    validate(flat.hmm)
    assert flat.paths == paths
    np.testing.assert_allclose(flat.hmm.transition.sum(axis=1) + flat.ending, 1.0)

    every = list(walks(root, likelihood))
    total = sum(p for *_, p in every)
    log_alpha = forward(
        flat.hmm.initial, flat.hmm.transition, emission.log_likelihood(observations)
    )
    assert np.exp(log_alpha[-1]).sum() == pytest.approx(total)

    ended = sum(p * q for _, stack, p in every for end, q in onward(stack) if not end)
    assert np.exp(log_alpha[-1]) @ flat.ending == pytest.approx(ended)

    active = summed(flat, posterior(flat.hmm, observations).states)
    for path, probability in active.items():
        expected = np.zeros(steps)
        for states, _, p in every:
            expected += [p / total * (state[: len(path)] == path) for state in states]
        np.testing.assert_allclose(probability, expected, atol=1e-12)


def test_a_call_that_returns_through_two_levels_may_come_down_to_the_same_state():
    inner = internal("inner", (Production("a"),), [1], [[0.5]], [0.5])
    outer = internal("outer", (inner,), [1], [[0.25]], [0.75])
    root = internal("root", (outer,), [1], [[0.9]], [0.1])
    flat = flattened(root, Discrete(np.ones((1, 1))))
    assert flat.hmm.transition[0, 0] == pytest.approx(0.5 + 0.5 * 0.25 + 0.5 * 0.75 * 0.9)
    assert flat.ending[0] == pytest.approx(0.5 * 0.75 * 0.1)
    assert flat.paths == (("root", "outer", "inner", "a"),)


def test_a_tree_of_one_level_is_the_hmm_itself():
    rng = np.random.default_rng(2)
    chain, start = rng.dirichlet(np.ones(3), size=3), rng.dirichlet(np.ones(3))
    children = tuple(Production(name) for name in "abc")
    flat = flattened(internal("root", children, start, chain, np.zeros(3)), random_emission(rng, 3))
    np.testing.assert_array_equal(flat.hmm.transition, chain)
    np.testing.assert_array_equal(flat.hmm.initial, start)


def test_what_the_tree_does_not_allow_is_a_structural_zero_of_the_flattened_model():
    def part(name):
        pair = (Production("first"), Production("second"))
        return internal(name, pair, [1, 0], [[0.5, 0.5], [0, 0.5]], [0, 0.5])

    root = internal("root", (part("one"), part("two")), [1, 0], [[0, 1], [0, 0]], [0, 1])
    flat = flattened(root, Discrete(np.eye(4)))
    np.testing.assert_array_equal(
        flat.hmm.transition > 0,
        np.array([[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], dtype=bool),
    )
    emission = flat.hmm.emission
    for possible, order in [(True, [0, 1, 2, 3]), (False, [0, 2, 3, 3]), (False, [0, 1, 2, 0])]:
        seen = emission.log_likelihood(np.array(order))
        found = log_likelihood(flat.hmm.initial, flat.hmm.transition, seen)
        assert np.isfinite(found) == possible


def test_an_internal_state_is_active_as_long_as_one_below_it():
    rng = np.random.default_rng(5)
    root = random_tree(rng, 3)
    count = len(list(leaves(root)))
    flat = flattened(root, random_emission(rng, count))
    states = rng.dirichlet(np.ones(count), size=7)
    np.testing.assert_allclose(summed(flat, states)[("root",)], 1.0)
    with pytest.raises(HierarchyError, match="is expected"):
        summed(flat, states[:, 1:])


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        (((), [], [], []), HierarchyError, "one or more"),
        ((("a", "a"), [1, 0], np.eye(2), [0, 0]), HierarchyError, "its own name"),
        ((("a", "b"), [1, 0], np.eye(3), [0, 0]), HierarchyError, r"shape \(3, 3\)"),
        ((("a", "b"), [1, 0], np.eye(2), [0]), HierarchyError, r"ending of shape \(1,\)"),
        ((("a", "b"), [1, 1], np.eye(2), [0, 0]), MarkovModelError, "entry of 'top'"),
        ((("a", "b"), [1, 0], np.eye(2), [0, 0.5]), MarkovModelError, "row 1 of transition and"),
    ],
)
def test_parts_that_make_no_tree_are_refused(parts, error, message):
    names, *chain = parts
    with pytest.raises(error, match=message):
        internal("top", tuple(Production(name) for name in names), *chain)


def test_an_emission_for_other_than_the_production_states_is_refused():
    root = internal("top", (Production("a"), Production("b")), [1, 0], np.eye(2), [0, 0])
    with pytest.raises(HierarchyError, match=r"top/a.*top/b"):
        flattened(root, Discrete(np.ones((3, 1))))
