"""The PUMA 560 as its publications have it: an oracle for engines that simulate it.

P. I. Corke, B. Armstrong-Helouvry: A search for consensus among model parameters reported for the
PUMA 560 robot. IEEE ICRA 1994.
"""

from __future__ import annotations

import numpy as np

D = [0.672, 0, 0.15005, 0.4318, 0, 0]
A = [0, 0.4318, 0.0203, 0, 0, 0]
ALPHA = [np.pi / 2, 0, -np.pi / 2, np.pi / 2, -np.pi / 2, 0]
MASS = [13.0, 17.4, 4.8, 0.82, 0.34, 0.09]
"""kg; that of link 1 was never published and no torque depends on it."""
CENTER = [
    (0, 0, 0),
    (-0.3638, 0.006, 0.2275),
    (-0.0203, -0.0141, 0.070),
    (0, 0.019, 0),
    (0, 0, 0),
    (0, 0, 0.032),
]
"""Centers of mass in DH frame i, m."""
INERTIA = [
    (0.35, 0.35, 0.35),
    (0.13, 0.524, 0.539),
    (0.066, 0.0784, 0.0125),
    (1.8e-3, 1.3e-3, 1.8e-3),
    (0.3e-3, 0.4e-3, 0.3e-3),
    (0.15e-3, 0.15e-3, 0.04e-3),
]
"""About the centers of mass, axes of DH frame i, kg·m²; 0.0784 is 0.086 in the publication."""
RANGES_DEG = [(-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266)]
RNG = np.random.default_rng(560)
LOWER, UPPER = np.radians(RANGES_DEG).T
CONFIGURATIONS = RNG.uniform(LOWER, UPPER, size=(50, 6))


def dh_frames(q: np.ndarray) -> list[np.ndarray]:
    frames = [np.eye(4)]
    for angle, d, a, alpha in zip(q, D, A, ALPHA, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        step = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        frames.append(frames[-1] @ np.array(step))
    return frames


def center_jacobians(q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the linear and angular Jacobian of each center of mass, and each link's rotation."""
    frames = dh_frames(q)
    result = []
    for link in range(6):
        turn, center = frames[link + 1][:3, :3], frames[link + 1] @ [*CENTER[link], 1]
        linear, angular = np.zeros((3, 6)), np.zeros((3, 6))
        for joint in range(link + 1):
            axis, origin = frames[joint][:3, 2], frames[joint][:3, 3]
            linear[:, joint] = np.cross(axis, center[:3] - origin)
            angular[:, joint] = axis
        result.append((linear, angular, turn))
    return result


def gravity_torques(q: np.ndarray) -> np.ndarray:
    """Return the gradient of the potential energy, N·m, shape (6,)."""
    parts = zip(MASS, center_jacobians(q), strict=True)
    return np.sum([mass * 9.81 * linear[2] for mass, (linear, _, _) in parts], axis=0)


def mass_matrix(q: np.ndarray) -> np.ndarray:
    """Return the mass matrix, kg·m², shape (6, 6)."""
    found = np.zeros((6, 6))
    for mass, inertia, (linear, angular, turn) in zip(
        MASS, INERTIA, center_jacobians(q), strict=True
    ):
        found += mass * linear.T @ linear
        found += angular.T @ turn @ np.diag(inertia) @ turn.T @ angular
    return found


def tool_frame(q: np.ndarray) -> np.ndarray:
    """Return the frame of the tip of its pen, shape (4, 4)."""
    pen = np.eye(4)
    pen[2, 3] = 0.05625 + 0.12
    return dh_frames(q)[-1] @ pen
