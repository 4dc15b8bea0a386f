from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm import inference
from hmcs_baselines.restarting import (
    Classification,
    ContinuedLevel,
    Cusum,
    CusumLevel,
    CusumSettings,
    GestemeChains,
    GestemeLevel,
    NetworkLevel,
)

MODELS, STATES, SYMBOLS = 3, 4, 5


def random_chains(rng: np.random.Generator) -> GestemeChains:
    """Left-right chains of 4, 3 and 2 states."""
    counts = np.array([4, 3, 2])
    initial, transition = np.zeros((MODELS, STATES)), np.zeros((MODELS, STATES, STATES))
    initial[:, 0] = 1.0
    for m, count in enumerate(counts):
        stay = rng.uniform(0.3, 0.9, count)
        stay[-1] = 1.0
        for i in range(count):
            transition[m, i, i] = stay[i]
            if i + 1 < count:
                transition[m, i, i + 1] = 1.0 - stay[i]
    return GestemeChains(initial, transition, counts)


def random_emissions(rng: np.random.Generator, steps: int) -> np.ndarray:
    tables = rng.dirichlet(np.full(SYMBOLS, 0.4), (MODELS, STATES)) * 0.95 + 0.05 / SYMBOLS
    return np.log(tables[:, :, rng.integers(SYMBOLS, size=steps)].transpose(2, 0, 1))


def shown(
    level: GestemeLevel, log_emissions: np.ndarray, marks: tuple[int, ...] = ()
) -> list[Classification]:
    return [level.step(t, seen, mark=t in marks) for t, seen in enumerate(log_emissions)]


def as_one_segment(chains: GestemeChains, log_emissions: np.ndarray) -> np.ndarray:
    """log P(observations up to each | model), shape (T, M), by the forward algorithm."""
    return np.stack(
        [
            np.logaddexp.reduce(
                inference.forward(chains.initial[m], chains.transition[m], log_emissions[:, m]),
                axis=1,
            )
            for m in range(MODELS)
        ],
        axis=1,
    )


def posterior(log_likelihoods: np.ndarray) -> np.ndarray:
    total = np.logaddexp.reduce(log_likelihoods, axis=1, keepdims=True)
    return np.asarray(np.exp(log_likelihoods - total))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_the_network_is_the_recursion_of_the_text(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chains, log_emissions = random_chains(rng), random_emissions(rng, 12)
    alpha = np.zeros((MODELS, STATES))
    alpha[:, 0] = 1.0
    for classification, seen in zip(
        shown(NetworkLevel(chains), log_emissions), np.exp(log_emissions), strict=True
    ):
        reset = sum(alpha[m, chains.states[m] - 1] for m in range(MODELS)) / MODELS
        following = np.zeros_like(alpha)
        for m in range(MODELS):
            for j in range(STATES):
                predicted = sum(alpha[m, i] * chains.transition[m, i, j] for i in range(STATES)) + (
                    reset if j == 0 else 0.0
                )
                following[m, j] = predicted * seen[m, j]
        alpha = following
        np.testing.assert_allclose(classification.gestemes, alpha.sum(axis=1) / alpha.sum())
        assert classification.start is None
        assert np.isfinite(classification.log_likelihood)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_given_restarts_evaluate_each_segment_by_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chains, log_emissions = random_chains(rng), random_emissions(rng, 15)
    marks = (0, 4, 5, 11)
    level = ContinuedLevel(chains, heeds_marks=True)
    classified = shown(level, log_emissions, marks)
    for begin, end in zip(marks, (*marks[1:], 15), strict=True):
        alone = as_one_segment(chains, log_emissions[begin:end])
        own = classified[begin:end]
        np.testing.assert_allclose([c.gestemes for c in own], posterior(alone), atol=1e-9)
        assert {c.start for c in own} == {begin}
        prior = np.full(len(alone[0]), -np.log(MODELS))
        np.testing.assert_allclose(
            sum(c.log_likelihood for c in own), np.logaddexp.reduce(alone[-1] + prior), rtol=1e-9
        )


def test_without_restarts_marks_change_nothing() -> None:
    rng = np.random.default_rng(1)
    chains, log_emissions = random_chains(rng), random_emissions(rng, 15)
    classified = shown(ContinuedLevel(chains, heeds_marks=False), log_emissions, (0, 4, 11))
    np.testing.assert_allclose(
        [c.gestemes for c in classified], posterior(as_one_segment(chains, log_emissions))
    )
    assert {c.start for c in classified} == {None}


def test_the_network_finds_back_from_a_gesteme_that_is_over_and_plain_counting_does_not() -> None:
    chains, emissions = two_symbols()
    changed = emissions[[0] * 200 + [1] * 5]
    assert shown(NetworkLevel(chains), changed)[-1].gestemes.argmax() == 1
    assert shown(ContinuedLevel(chains, heeds_marks=False), changed)[-1].gestemes.argmax() == 0


def two_symbols() -> tuple[GestemeChains, np.ndarray]:
    """Two gestemes of one state and log P(symbol), shape (2 symbols, 2 gestemes, 1 state)."""
    chains = GestemeChains(np.ones((2, 1)), np.ones((2, 1, 1)), np.array([1, 1]))
    return chains, np.log([[[0.9], [0.1]], [[0.1], [0.9]]])


@pytest.mark.parametrize("change", [5, 20, 60])
def test_cusum_restarts_once_and_where_the_change_is(change: int) -> None:
    chains, emissions = two_symbols()
    classified = shown(
        CusumLevel(chains, CusumSettings(drift_nats=0.5, threshold_nats=3.0)),
        emissions[[0] * change + [1] * 20],
    )
    starts = [-1 if c.start is None else c.start for c in classified]
    assert starts == sorted(starts)
    assert set(starts) == {0, change}
    # One observation of the other kind might be an error, three are none.
    assert starts.index(change) <= change + 2
    alone = posterior(np.cumsum(emissions[[1] * 20, :, 0], axis=0))
    found = starts.index(change)
    np.testing.assert_allclose(
        [c.gestemes for c in classified[found:]], alone[found - change :], atol=1e-9
    )


def test_cusum_keeps_no_more_than_it_may_need() -> None:
    chains, emissions = two_symbols()
    level = CusumLevel(chains, CusumSettings())
    shown(level, emissions[[0] * 500])
    assert len(level._suspects) == 0


@given(st.lists(st.floats(-5, 0), min_size=1, max_size=40))
@settings(max_examples=50)
def test_the_cusum_test_is_that_of_the_text(values: list[float]) -> None:
    test = Cusum(CusumSettings(drift_nats=0.3, threshold_nats=2.0))
    statistic, zero = 0.0, 0
    for n, value in enumerate(values):
        if n:
            statistic += float(np.mean(values[:n])) - value - 0.3
        if n == 0 or statistic < 0:
            statistic, zero = 0.0, n
        alarm = test.step(value)
        if abs(statistic - 2.0) < 1e-6 or abs(statistic) < 1e-9:
            # On the edge rounding decides, and what follows depends on it.
            return
        assert alarm == (statistic > 2.0)
        assert test.suspects == n - zero
