"""When gesteme HMMs begin anew: the four answers the thesis knows (4.2.1, 2.34–2.35).

All gesteme HMMs run in parallel; what they say of the motion depends on where they start to count.
Shapes: M gesteme HMMs of N states each, padded as in `GestemeChains`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs_baselines.hmm.bank import ForwardBank

Integers = NDArray[np.int64]

Restart = Literal["given", "cusum", "network", "never"]


class GestemeChains(NamedTuple):
    """The Markov chains of gesteme HMMs; those of fewer states are padded with zeros."""

    initial: Array
    """P(state at the start of the gesteme), shape (M, N)."""
    transition: Array
    """P(state j next | state i), shape (M, N, N)."""
    states: Integers
    """How many states each gesteme really has, shape (M,)."""


class CusumSettings(NamedTuple):
    """The CUSUM test (2.21–2.22) of the likelihood of the most probable gesteme (4.2.1)."""

    drift_nats: float = 0.5
    """ν: an observation may be so much less likely than the mean since the restart before it
    counts."""
    threshold_nats: float = 1.5
    """h: a change is found when what counts adds up to more than this."""


class Classification(NamedTuple):
    """What gesteme HMMs make of the observations since their restart."""

    gestemes: Array
    """P(gesteme | observations), shape (M,), all gestemes alike before them."""
    log_likelihood: float
    """log P(newest observation | those before it), nats."""
    start: int | None
    """The step the HMMs were restarted with; None where they are not restarted together."""


class GestemeLevel(Protocol):
    """Gesteme HMMs in parallel."""

    def step(self, index: int, log_emission: Array, *, mark: bool) -> Classification:
        """Take what was observed in a step: log P(observation | state), shape (M, N).

        `mark` says that a new gesteme begins here; only a level that is given restarts heeds it.
        """
        ...


def gesteme_level(chains: GestemeChains, restart: Restart, cusum: CusumSettings) -> GestemeLevel:
    """Return fresh gesteme HMMs that begin anew as `restart` says."""
    if restart == "network":
        return NetworkLevel(chains)
    if restart == "cusum":
        return CusumLevel(chains, cusum)
    return ContinuedLevel(chains, heeds_marks=restart == "given")


class ContinuedLevel:
    """The HMMs count from the last mark (restart given) or from the first observation (never)."""

    def __init__(self, chains: GestemeChains, *, heeds_marks: bool) -> None:
        self._bank = ForwardBank(chains.initial, chains.transition)
        self._heeds_marks = heeds_marks
        self._start: int | None = None
        self._total = _log_total(self._bank.log_likelihood)

    def step(self, index: int, log_emission: Array, *, mark: bool) -> Classification:
        """Take the next observation."""
        if mark and self._heeds_marks:
            self.restart()
        if self._start is None:
            self._start = index
        self._bank.step(log_emission)
        likelihoods = self._bank.log_likelihood
        total, before = _log_total(likelihoods), self._total
        self._total = total
        start = self._start if self._heeds_marks else None
        gestemes = np.exp(likelihoods - likelihoods.max())
        return Classification(gestemes / gestemes.sum(), total - before, start)

    @property
    def most_likely(self) -> float:
        """log P(observations since the restart | the most probable gesteme), nats."""
        return float(self._bank.log_likelihood.max())

    def restart(self) -> None:
        """Begin anew with the next observation."""
        self._bank.reset()
        self._start, self._total = None, _log_total(self._bank.log_likelihood)


class Cusum:
    """The one-sided CUSUM test (2.21–2.22) for a fall of what it is shown below its mean so far."""

    def __init__(self, settings: CusumSettings) -> None:
        self._settings = settings
        self.restart()

    @property
    def suspects(self) -> int:
        """How many of the last values would be those after a change, if there was one."""
        return self._suspects

    def restart(self, values: Sequence[float] = ()) -> None:
        """Forget what was seen; if values are given, it was these and they are no suspects."""
        self._statistic, self._suspects, self._seen = 0.0, 0, len(values)
        self._mean = sum(values) / len(values) if values else 0.0

    def step(self, value: float) -> bool:
        """Take the next value; return whether there is an alarm."""
        if self._seen:
            self._statistic += self._mean - value - self._settings.drift_nats
            self._suspects += 1
        self._seen += 1
        self._mean += (value - self._mean) / self._seen
        if self._statistic < 0:
            self._statistic, self._suspects = 0.0, 0
        return self._statistic > self._settings.threshold_nats


class CusumLevel:
    """The HMMs restart where the most probable one ceases to explain the motion (4.2.1).

    At an alarm they count from the observation after the last one that left the test at zero:
    the change is estimated to be there (2.1.5), so what was observed since is not lost.
    """

    def __init__(self, chains: GestemeChains, settings: CusumSettings) -> None:
        self._level = ContinuedLevel(chains, heeds_marks=True)
        self._test = Cusum(settings)
        self._suspects: list[tuple[int, Array]] = []

    def step(self, index: int, log_emission: Array, *, mark: bool) -> Classification:
        """Take the next observation."""
        self._suspects.append((index, log_emission))
        classification, gain = self._taken(index, log_emission)
        alarm = self._test.step(gain)
        self._suspects = self._suspects[len(self._suspects) - self._test.suspects :]
        if alarm:
            self._level.restart()
            taken = [self._taken(*suspect) for suspect in self._suspects]
            self._test.restart([gain for _, gain in taken])
            self._suspects = []
            classification = taken[-1][0]
        return classification

    def _taken(self, index: int, log_emission: Array) -> tuple[Classification, float]:
        """The classification, and the change of the most probable gesteme's log-likelihood."""
        before = self._level.most_likely
        classification = self._level.step(index, log_emission, mark=False)
        return classification, self._level.most_likely - before


class NetworkLevel:
    """The online network of Li and Okamura (2003): every HMM is always being restarted.

    α of all HMMs are kept on one scale, as of one HMM. In each step the mean of what stands in the
    HMMs' last (resetting) states is added to what is predicted for the first state of each (2.35).
    """

    def __init__(self, chains: GestemeChains) -> None:
        models, states = self._shape = chains.initial.shape
        each = np.arange(models)
        network = np.zeros((models, states, models, states))
        network[each, :, each] = chains.transition
        network[each, chains.states - 1, :, 0] += 1.0 / models
        joined = network.reshape(models * states, models * states)
        # (2.34) at its scale.
        first = np.zeros((models, states))
        first[:, 0] = 1.0 / models
        predicted = first.ravel() @ joined
        self._filter = ForwardBank(predicted[None], joined[None])
        self._leaving = joined.sum(axis=1)
        self._predicted = float(predicted.sum())

    def step(self, index: int, log_emission: Array, *, mark: bool) -> Classification:
        """Take the next observation."""
        gain = float(self._filter.step(log_emission.reshape(1, -1))[0])
        alpha = self._filter.states[0]
        # The reset states' mass counts twice, so a total is set against what was predicted.
        log_likelihood = gain - float(np.log(self._predicted))
        self._predicted = float(alpha @ self._leaving)
        return Classification(alpha.reshape(self._shape).sum(axis=1), log_likelihood, None)


def _log_total(log_likelihoods: Array) -> float:
    return float(np.logaddexp.reduce(log_likelihoods))
