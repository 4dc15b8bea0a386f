"""A tone that rises with the deviation from the guide, as a sound file that a page loops.

A page can be given no program, but it plays a sound that stands in it. So the deviation becomes one
of a few levels, and each of them is a short file of a whole number of periods.
"""

from __future__ import annotations

import base64
import io
import math
import wave
from functools import cache

import numpy as np

SILENT = 0
LEVELS = 16
"""Levels that sound, 1 to so many; a level of 0 is silent."""
SILENT_BELOW_M = 0.002
HIGHEST_FROM_M = 0.040
"""From so much on the tone rises no more."""

_LOWEST_HZ = 220.0
_OCTAVES = 2.0
_STICKS = 0.4
"""Share of a level's width that the deviation goes beyond it before the level changes."""
_RATE_HZ = 8000
_LASTS_S = 0.5
_LOUDNESS = 0.2
_BAND_M = (HIGHEST_FROM_M - SILENT_BELOW_M) / (LEVELS - 1)


def level_of(off_guide_m: float | None, before: int) -> int:
    """Return the level of a deviation, m, after a level it had before; None is silent.

    It stays as it was until the deviation is clearly beyond it, so that it does not flutter.
    """
    if off_guide_m is None or off_guide_m < SILENT_BELOW_M:
        return SILENT
    if off_guide_m >= HIGHEST_FROM_M:
        return LEVELS
    # Level n reaches from n − 1 bands above where silence ends to n bands.
    bands = (off_guide_m - SILENT_BELOW_M) / _BAND_M + 1.0
    stays = before - _STICKS <= bands < before + 1 + _STICKS
    return before if stays else int(np.floor(bands))


def frequency_hz(level: int) -> float:
    """Return the frequency of a level that sounds, Hz: two octaves from the lowest to the highest.

    It is that of a whole number of periods in the file.
    """
    octaves = _OCTAVES * (level - 1) / (LEVELS - 1)
    return round(_LOWEST_HZ * math.exp2(octaves) * _LASTS_S) / _LASTS_S


@cache
def wav_of(level: int) -> bytes:
    """Return the sound file of a level that sounds: mono, 16 bit, without a seam where it loops."""
    times_s = np.arange(round(_RATE_HZ * _LASTS_S)) / _RATE_HZ
    samples = _LOUDNESS * 32767 * np.sin(2 * np.pi * frequency_hz(level) * times_s)
    file = io.BytesIO()
    with wave.open(file, "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(_RATE_HZ)
        sound.writeframes(samples.astype("<i2").tobytes())
    return file.getvalue()


def html_of(level: int) -> str:
    """Return what a page plays a level by; empty where it is silent."""
    if level == SILENT:
        return ""
    data = base64.b64encode(wav_of(level)).decode()
    return f'<audio autoplay loop src="data:audio/wav;base64,{data}"></audio>'
