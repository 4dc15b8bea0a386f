"""Hidden Markov models: learning and filtering many at once, beside hmmlearn in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from hmmlearn.hmm import GaussianHMM

from bench.figures import Figure, tell
from hmcs.arrays import Array
from hmcs.recognition.hmm.emissions import Gaussian
from hmcs.recognition.hmm.model import Hmm, sample
from hmcs.recognition.hmm.topologies import fully_connected, left_right, start_anywhere, start_in
from hmcs_baselines.hmm.bank import ForwardBank, GaussianScores
from hmcs_baselines.hmm.batch import baum_welch_many

LEARNING_RATIO = 5.0
SAME_LIKELIHOOD = 1e-6
LARGE_UPDATE_US = 200.0
FILTER_RATIO = 50.0
MODELS, SEQUENCES, STATES, DIMENSIONS = 25, 5, 5, 3
LARGE_MODELS, LARGE_STATES, LARGE_DIMENSIONS = 1000, 10, 4
ITERATIONS = 20


class Work(NamedTuple):
    """One model to learn: where learning starts, and from what."""

    start: Hmm[Gaussian]
    sequences: list[Array]


def measure(repeats: int) -> list[Figure]:
    """Measure each `repeats` times; a time is the fastest of them, ours and theirs in turn."""
    return [*learning(repeats), *filtering(repeats), *large_update(repeats)]


def learning(repeats: int) -> list[Figure]:
    """Baum–Welch from the same start, for the same number of iterations, to the same likelihood."""
    work = gestures(np.random.default_rng(0))
    ours_s, log_s, scaling_s = fastest(
        repeats,
        lambda: learn_ours(work),
        lambda: learn_theirs(work, "log"),
        lambda: learn_theirs(work, "scaling"),
    )
    ours = np.array(learn_ours(work))
    theirs = np.array(
        [
            peer.score(*stacked(each.sequences))
            for peer, each in zip(learn_theirs(work, "log"), work, strict=True)
        ]
    )
    return [
        Figure(f"Baum–Welch, {MODELS} models, {ITERATIONS} iterations", 1e3 * ours_s, "ms"),
        Figure(
            "hmmlearn's time / ours, its faster implementation",
            min(log_s, scaling_s) / ours_s,
            at_least=LEARNING_RATIO,
        ),
        Figure(
            "largest relative difference of log-likelihoods",
            float(np.max(np.abs(ours - theirs) / np.abs(theirs))),
            at_most=SAME_LIKELIHOOD,
        ),
    ]


def filtering(repeats: int) -> list[Figure]:
    """One new observation of 25 models.

    hmmlearn keeps no state between calls: its users score the whole sequence anew with each
    observation. Its cost is the mean over a sequence of common length as it grows.
    """
    work = gestures(np.random.default_rng(1))
    models = [each.start for each in work]
    seen = work[0].sequences[0]
    bank = ForwardBank(
        np.stack([model.initial for model in models]),
        np.stack([model.transition for model in models]),
    )
    scores = GaussianScores(
        np.stack([model.emission.means for model in models]),
        np.stack([model.emission.variances for model in models]),
    )
    peers = {
        implementation: [as_hmmlearn(model, implementation) for model in models]
        for implementation in ("log", "scaling")
    }
    ours_s, log_s, scaling_s = (
        seconds / len(seen)
        for seconds in fastest(
            repeats,
            lambda: run(bank, scores, seen),
            lambda: rescore(peers["log"], seen),
            lambda: rescore(peers["scaling"], seen),
        )
    )
    return [
        Figure(f"filter update, {MODELS} models × {STATES} states", 1e6 * ours_s, "µs"),
        Figure(
            f"hmmlearn scores the sequence anew (mean of 1–{len(seen)} samples) / ours",
            min(log_s, scaling_s) / ours_s,
            at_least=FILTER_RATIO,
        ),
    ]


def large_update(repeats: int) -> list[Figure]:
    """One new observation of 1000 models, Gaussian emissions in four dimensions included."""
    rng = np.random.default_rng(2)
    shape = (LARGE_MODELS, LARGE_STATES)
    scores = GaussianScores(
        rng.normal(size=(*shape, LARGE_DIMENSIONS)),
        rng.uniform(0.5, 2.0, size=(*shape, LARGE_DIMENSIONS)),
    )
    seen = rng.normal(size=(10, LARGE_DIMENSIONS))
    initial = np.broadcast_to(start_in(LARGE_STATES), shape)
    banks = [
        ForwardBank(initial, np.broadcast_to(transition, (*shape, LARGE_STATES)))
        for transition in (fully_connected(LARGE_STATES), left_right(LARGE_STATES, 0.2, skip=0.1))
    ]
    times = fastest(10 * repeats, *(lambda bank=bank: run(bank, scores, seen) for bank in banks))
    return [
        Figure(
            f"filter update, {LARGE_MODELS} models × {LARGE_STATES} states, {name}",
            1e6 * seconds / len(seen),
            "µs",
            at_most=LARGE_UPDATE_US,
        )
        for name, seconds in zip(("fully connected", "left-right"), times, strict=True)
    ]


def gestures(rng: np.random.Generator) -> list[Work]:
    """Left-right models, sequences of 20 to 40 observations of each, and a start beside them.

    The start is fully connected: hmmlearn refuses what it learns of a left-right one whose last
    state no sequence stays in.
    """
    work = []
    for _ in range(MODELS):
        shape = (STATES, DIMENSIONS)
        means = rng.normal(size=shape)
        true = Hmm(
            start_in(STATES),
            left_right(STATES, 0.15),
            Gaussian(means, rng.uniform(0.05, 0.3, size=shape)),
        )
        sequences = [
            sample(true, int(rng.integers(20, 41)), rng).observations for _ in range(SEQUENCES)
        ]
        moved = Gaussian(means + 0.3 * rng.normal(size=shape), np.ones(shape))
        work.append(Work(Hmm(start_anywhere(STATES), fully_connected(STATES), moved), sequences))
    return work


def learn_ours(work: Sequence[Work]) -> list[float]:
    """Return the final log-likelihood of each model."""
    learned = baum_welch_many(
        [each.start for each in work],
        [each.sequences for each in work],
        max_iterations=ITERATIONS,
        tolerance=-np.inf,
    )
    return [each.log_likelihoods[-1] for each in learned]


def learn_theirs(work: Sequence[Work], implementation: str) -> list[GaussianHMM]:
    """Return each model, learned by hmmlearn."""
    return [as_hmmlearn(each.start, implementation).fit(*stacked(each.sequences)) for each in work]


def stacked(sequences: Sequence[Array]) -> tuple[Array, list[int]]:
    """Return sequences as hmmlearn takes them: one after another, and their lengths."""
    return np.concatenate(sequences), [len(sequence) for sequence in sequences]


def as_hmmlearn(model: Hmm[Gaussian], implementation: str) -> GaussianHMM:
    """Return the same model with priors that weigh nothing, so that both maximize the same."""
    peer = GaussianHMM(
        len(model.initial),
        covariance_type="diag",
        init_params="",
        n_iter=ITERATIONS,
        tol=-np.inf,
        covars_prior=0.0,
        covars_weight=1.0,
        min_covar=0.0,
        implementation=implementation,
    )
    peer.startprob_, peer.transmat_ = model.initial, model.transition
    peer.means_, peer.covars_ = model.emission.means, model.emission.variances
    return peer


def run(bank: ForwardBank, scores: GaussianScores, seen: Array) -> None:
    """Filter a whole sequence, observation by observation."""
    bank.reset()
    for observation in seen:
        bank.step(scores.log_emission(observation))


def rescore(peers: Sequence[GaussianHMM], seen: Array) -> None:
    """Score a sequence as it grows by each observation."""
    for t in range(1, len(seen) + 1):
        for peer in peers:
            peer.score(seen[:t])


def fastest(repeats: int, *jobs: Callable[[], object]) -> list[float]:
    """Return the shortest time of each job, s; they run in turn, once unmeasured."""
    times = np.full((repeats + 1, len(jobs)), np.inf)
    for repeat in range(repeats + 1):
        for j, job in enumerate(jobs):
            begun = time.perf_counter()
            job()
            times[repeat, j] = time.perf_counter() - begun
    return [float(seconds) for seconds in times[1:].min(axis=0)]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(20)))
