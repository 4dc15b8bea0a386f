"""A device whose every sample was recorded: dead-man, clutch and pedal as they were."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from hmcs.bus.messages import Motion
from hmcs.errors import UserError
from hmcs.recordings.hands import hand_of
from hmcs.recordings.reading import read
from hmcs.task import Task
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import DeviceSample

LEAST_RATE_HZ, MOST_RATE_HZ = 30.0, 1000.0


class Logged:
    """Plays the samples of a recording once; at rest, with the dead-man released, around that."""

    plays = True

    def __init__(
        self, times_s: Sequence[float], motions: Sequence[Motion], lead_in_s: float
    ) -> None:
        """Play `motions`, taken at `times_s` since the first, after `lead_in_s` of rest."""
        self._times_s = list(times_s)
        self._motions = list(motions)
        self._lead_in_s = lead_in_s
        gaps = np.diff(self._times_s)
        usual_s = float(np.median(gaps)) if len(gaps) else 0.01
        self.rate_hz = min(max(1.0 / max(usual_s, 1e-6), LEAST_RATE_HZ), MOST_RATE_HZ)
        self.duration_s = lead_in_s + self._times_s[-1]
        positions = np.array([motion.position for motion in self._motions])
        self.reach_m = float(np.linalg.norm(positions - positions[0], axis=1).max())

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the device `elapsed_s` after the request to play."""
        if elapsed_s is None or elapsed_s < self._lead_in_s:
            return DeviceSample(self._motions[0].position, np.zeros(3), dead_man=False)
        if elapsed_s > self.duration_s:
            return DeviceSample(self._motions[-1].position, np.zeros(3), dead_man=False)
        at = max(bisect_right(self._times_s, elapsed_s - self._lead_in_s) - 1, 0)
        return DeviceSample(**dict(self._motions[at]))

    def close(self) -> None:
        """Nothing is held."""


def recording(settings: InputDeviceSettings, task: Task) -> Logged:
    """Return a source that is the device of a recording, as it was.

    Raises UserError where none is named or it has no samples, RecordingError where it cannot be
    read.
    """
    del task
    if settings.demonstration is None:
        raise UserError(
            "demonstration: the source 'recording' needs one: give an MCAP file with "
            "--demonstration"
        )
    taken = list(hand_of(read(settings.demonstration)))
    if not taken:
        raise UserError(
            f"{settings.demonstration}: has no samples of a device that was held: record one anew"
        )
    first_ns = taken[0].captured_ns
    times_s = np.maximum.accumulate([(each.captured_ns - first_ns) / 1e9 for each in taken])
    motions = [each.motion for each in taken]
    if settings.speed != 1.0:
        motions = [_faster(motion, settings.speed) for motion in motions]
    return Logged((times_s / settings.speed).tolist(), motions, settings.lead_in_s)


def _faster(motion: Motion, speed: float) -> Motion:
    turning = motion.angular_velocity
    return motion.model_copy(
        update={
            "velocity": speed * motion.velocity,
            "angular_velocity": None if turning is None else speed * turning,
        }
    )
