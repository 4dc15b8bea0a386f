"""Models and oracles that several files of tests look at."""

from itertools import product

import numpy as np
import pytest

from hmcs.recognition.hmm.emissions import Discrete, Gaussian, Mixture, MultiDiscrete
from hmcs.recognition.hmm.model import Hmm


@pytest.fixture(scope="session")
def random_chain():
    """A function of a seed and a number of states: random π and A, in one."""

    def make(seed, states, zeros=False):
        rng = np.random.default_rng(seed)
        initial = rng.dirichlet(np.ones(states))
        transition = rng.dirichlet(np.ones(states), size=states)
        if zeros:
            transition = np.triu(transition)
            transition /= transition.sum(axis=1, keepdims=True)
        return initial, transition

    return make


@pytest.fixture(scope="session")
def random_emission():
    """A function of a kind, a seed and a number of states."""

    def make(kind, seed, states):
        rng = np.random.default_rng([seed, 1])
        rows = np.ones(4), states
        if kind == "discrete":
            return Discrete(rng.dirichlet(*rows))
        if kind == "multi-discrete":
            other = rng.dirichlet(np.ones(3), states)
            return MultiDiscrete((Discrete(rng.dirichlet(*rows)), Discrete(other)))
        if kind == "gaussian":
            shape = (states, 2)
            return Gaussian(rng.normal(size=shape), rng.uniform(0.2, 2.0, size=shape))
        shape = (states, 2, 2)
        return Mixture(
            rng.dirichlet(np.ones(2), states),
            rng.normal(size=shape),
            rng.uniform(0.2, 2.0, size=shape),
        )

    return make


@pytest.fixture(scope="session")
def random_model(random_chain, random_emission):
    """A function of a kind of emission, a seed and a number of states."""

    def make(kind, seed, states):
        return Hmm(*random_chain(seed, states), random_emission(kind, seed, states))

    return make


@pytest.fixture(scope="session")
def every_path():
    """A function that yields every hidden path and its joint probability with the observations."""

    def paths(initial, transition, log_emission):
        steps, states = log_emission.shape
        emission = np.exp(log_emission)
        for path in product(range(states), repeat=steps):
            p = initial[path[0]] * emission[0, path[0]]
            for t in range(1, steps):
                p *= transition[path[t - 1], path[t]] * emission[t, path[t]]
            yield path, p

    return paths
