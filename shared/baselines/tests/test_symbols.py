"""Observation symbols of directions: OD, MD and FFT, over a whole sequence and step by step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_baselines.clustering import ClusteringError
from hmcs_baselines.symbols import (
    Codebook,
    Fourier,
    FourierWindow,
    SymbolError,
    direction_bins,
    fit_bins,
    fit_codebook,
    fourier_features,
)


def directions(seed, steps, axes=2):
    raw = np.random.default_rng(seed).normal(size=(steps, axes))
    return raw / np.linalg.norm(raw, axis=1, keepdims=True)


def test_a_code_book_gives_every_direction_its_nearest_center():
    training = [directions(seed, 40) for seed in range(5)]
    book = fit_codebook(training, np.random.default_rng(0))
    assert book.centers.shape == (25, 2)
    seen = directions(9, 50)
    nearest = [int(np.argmin([np.linalg.norm(x - c) for c in book.centers])) for x in seen]
    assert list(book.encode(seen)) == nearest


def test_direction_bins_are_two_over_their_number_wide():
    bins = direction_bins(2)
    edges = np.linspace(-1, 1, 11)
    inside = np.stack([edges[:-1] + 0.1, edges[:-1] + 0.1], axis=1)
    assert (bins.encode(inside) == np.arange(10)[:, None]).all()
    assert bins.encode([[-1.0, 1.0], [-1.5, 1.5]]).tolist() == [[0, 9], [0, 9]]


def test_fitted_bins_span_what_was_seen_and_hold_a_constant_feature():
    bins = fit_bins([[[0.0, 3.0]], [[4.0, 3.0]]], count=4)
    assert bins.encode([[0.5, 3.0], [3.5, 3.0], [9.0, 3.0]])[:, 0].tolist() == [0, 3, 3]
    assert len(np.unique(bins.encode([[0.5, 3.0], [3.5, 3.0]])[:, 1])) == 1


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    steps=st.integers(1, 25),
    axes=st.integers(2, 3),
    window=st.integers(1, 9),
    hop=st.integers(1, 5),
    kept=st.sampled_from(["complex", "magnitude"]),
)
def test_step_by_step_gives_the_features_and_symbols_of_the_whole(
    seed, steps, axes, window, hop, kept
):
    fourier = Fourier(window, hop, kept)
    seen = directions(seed, steps, axes)
    whole = fourier_features(seen, fourier)
    online = FourierWindow(fourier)
    pushed = [online.push(x) for x in seen]
    assert [t for t, p in enumerate(pushed) if p is not None] == list(range(0, steps, hop))
    steps_in_turn = np.array([p for p in pushed if p is not None])
    np.testing.assert_array_equal(steps_in_turn, whole)
    bins = fit_bins([fourier_features(directions(1, 60, axes), fourier)])
    book = Codebook(whole[:1])
    assert (bins.encode(steps_in_turn) == bins.encode(whole)).all()
    assert (book.encode(steps_in_turn) == book.encode(whole)).all()


def test_the_features_of_a_part_are_the_first_of_the_whole():
    seen = directions(3, 20)
    np.testing.assert_array_equal(fourier_features(seen[:8]), fourier_features(seen)[:3])


def test_windows_are_the_discrete_fourier_transform_under_a_hamming_window():
    seen = directions(4, 12)
    window = (0.54 - 0.46 * np.cos(2 * np.pi * np.arange(6) / 5))[:, None] * seen[1:7]
    by_hand = np.array(
        [sum(window[n] * np.exp(-2j * np.pi * k * n / 6) for n in range(6)) for k in range(4)]
    )
    magnitude = fourier_features(seen, Fourier(kept="magnitude"))
    np.testing.assert_allclose(magnitude[2], np.abs(by_hand).T.ravel(), atol=1e-12)
    parts = fourier_features(seen)
    wanted = [np.concatenate([c.real, c.imag[1:3]]) for c in by_hand.T]
    np.testing.assert_allclose(parts[2], np.concatenate(wanted), atol=1e-12)


def test_a_sequence_of_one_step_is_taken_as_having_gone_that_way_before():
    one = directions(5, 1)
    np.testing.assert_array_equal(
        fourier_features(one), fourier_features(np.repeat(one, 7, axis=0))[-1:]
    )


def test_a_reset_window_forgets():
    seen = directions(6, 10)
    window = FourierWindow()
    for x in seen[:4]:
        window.push(x)
    window.reset()
    np.testing.assert_array_equal(window.push(seen[5]), fourier_features(seen[5:6])[0])


def test_bad_input_is_refused():
    with pytest.raises(SymbolError, match="step 1"):
        direction_bins(2).encode([[0.0, 1.0], [np.nan, 0.0]])
    with pytest.raises(SymbolError, match=r"\(T, 2\)"):
        direction_bins(2).encode([[0.0, 1.0, 0.0]])
    with pytest.raises(SymbolError, match="no directions"):
        fourier_features(np.zeros((0, 2)))
    with pytest.raises(SymbolError, match="no features"):
        fit_bins([])
    with pytest.raises(SymbolError, match="shape"):
        fit_bins([[[0.0, 1.0]], [[0.0, 1.0, 2.0]]])
    with pytest.raises(ClusteringError, match="10 distinct"):
        fit_codebook([directions(0, 10)], np.random.default_rng(0))
    window = FourierWindow()
    window.push([0.0, 1.0])
    with pytest.raises(SymbolError, match="shape"):
        window.push([0.0, 1.0, 0.0])
