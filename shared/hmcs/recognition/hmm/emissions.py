"""Observation probabilities of hidden Markov models (thesis 2.1.2)."""

from __future__ import annotations

import numpy as np

from hmcs.recognition.hmm.inference import Array


def log_gaussians(means: Array, variances: Array, observations: Array) -> Array:
    """Return log N(observation; mean, diag variance), shape (T, N)."""
    difference = observations[:, None, :] - means[None, :, :]
    terms = difference**2 / variances + np.log(2.0 * np.pi * variances)
    return np.asarray(-0.5 * terms.sum(axis=2))
