from __future__ import annotations

import base64
import io
import re
import wave

import numpy as np
import pytest

from hmcs_console.telling.tone import (
    HIGHEST_FROM_M,
    LEVELS,
    SILENT,
    SILENT_BELOW_M,
    frequency_hz,
    html_of,
    level_of,
    wav_of,
)

EVERY_LEVEL = range(1, LEVELS + 1)


def samples(level: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    with wave.open(io.BytesIO(wav_of(level))) as sound:
        assert (sound.getnchannels(), sound.getsampwidth(), sound.getframerate()) == (1, 2, 8000)
        return np.frombuffer(sound.readframes(sound.getnframes()), "<i2").astype(float)


def test_near_the_guide_and_where_nobody_knows_it_is_silent() -> None:
    for before in range(LEVELS + 1):
        assert level_of(None, before) == SILENT
        assert level_of(0.99 * SILENT_BELOW_M, before) == SILENT
    assert html_of(SILENT) == ""


def test_far_from_the_guide_the_tone_is_highest() -> None:
    for before in range(LEVELS + 1):
        assert level_of(HIGHEST_FROM_M, before) == LEVELS
        assert level_of(10.0, before) == LEVELS


def test_the_tone_rises_with_the_deviation_level_by_level() -> None:
    level, heard = SILENT, []
    for off_m in np.linspace(0.0, 0.05, 1000):
        level = level_of(off_m, level)
        heard.append(level)
    assert heard == sorted(heard)
    assert set(heard) == set(range(LEVELS + 1))


def test_a_deviation_that_trembles_at_a_border_does_not_change_the_tone() -> None:
    for border_m in np.linspace(SILENT_BELOW_M, HIGHEST_FROM_M, LEVELS)[1:-1]:
        level = level_of(border_m, SILENT)
        for off_m in border_m + np.array([-5e-4, 5e-4, -8e-4, 8e-4]):
            assert level_of(off_m, level) == level


def test_there_are_two_octaves_in_even_steps() -> None:
    heard = np.array([frequency_hz(level) for level in EVERY_LEVEL])
    assert heard[-1] / heard[0] == pytest.approx(4.0, rel=0.01)
    assert np.allclose(heard[1:] / heard[:-1], 2.0 ** (2 / (LEVELS - 1)), rtol=0.01)


@pytest.mark.parametrize("level", EVERY_LEVEL)
def test_a_file_loops_without_a_seam(level: int) -> None:
    sound = samples(level)
    spectrum = np.abs(np.fft.rfft(sound))
    # A whole number of periods has all its power in one line; a seam would spread it.
    assert spectrum.argmax() * 8000 / len(sound) == pytest.approx(frequency_hz(level))
    assert spectrum.max() ** 2 > 0.9999 * np.sum(spectrum**2)
    assert len(wav_of(level)) < 10_000


def test_a_page_plays_it_again_and_again_from_what_stands_in_it() -> None:
    html = html_of(3)
    found = re.fullmatch(r'<audio autoplay loop src="data:audio/wav;base64,([^"]+)"></audio>', html)
    assert found is not None
    assert base64.b64decode(found[1]) == wav_of(3)
