"""Torques of motors that hold joint velocities, each as strong as it is."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array


def torques_for(acceleration: Array, mass: Array, bias: Array, most: Array) -> Array:
    """Return the torques, N·m, shape (n,), that accelerate joints as asked, where they can.

    `acceleration`, rad/s², shape (n,); `mass` is the mass matrix, (n, n), `bias` what gravity and
    motion ask for, (n,), `most` the largest torques, (n,). Joints whose motor is too weak are
    accelerated with all it has, and the others as asked all the same.
    """
    torques: Array = mass @ acceleration + bias
    weak = np.zeros(len(torques), dtype=bool)
    for _ in range(len(torques)):
        beyond = (np.abs(torques) > most) & ~weak
        if not beyond.any():
            break
        torques[beyond] = np.copysign(most, torques)[beyond]
        weak |= beyond
        strong = ~weak
        # What the weak joints do instead follows from their own rows of M a + b = τ.
        reached = acceleration.copy()
        reached[weak] = np.linalg.solve(
            mass[np.ix_(weak, weak)],
            torques[weak] - bias[weak] - mass[np.ix_(weak, strong)] @ acceleration[strong],
        )
        torques[strong] = mass[strong] @ reached + bias[strong]
    return np.clip(torques, -most, most)
