"""The alarm: few false ones on motion like that it was learned from, and no single step decides."""

import numpy as np
import pytest

from hmcs.recognition.unknown import AlarmSettings, UnknownAlarm, fit_of, learn_alarm


def alarms(settings: AlarmSettings, fits: np.ndarray) -> list[bool]:
    alarm = UnknownAlarm(settings)
    return [alarm.step(float(fit), 0.0)[1] for fit in fits]


def test_about_one_window_in_a_hundred_of_known_motion_is_an_alarm_at_most():
    rates = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        level = rng.normal(2.0, 0.2, size=6)
        settings = learn_alarm([rng.normal(one, 1.0, 100) for one in level], 20)
        rates.append(np.mean(alarms(settings, rng.normal(rng.normal(2.0, 0.2), 1.0, 400))))
    assert np.mean(rates) < 0.01


def test_motion_that_fits_much_worse_is_an_alarm_once_the_window_is_full():
    rng = np.random.default_rng(0)
    settings = learn_alarm([rng.normal(2.0, 1.0, 100) for _ in range(5)], 20)
    reported = alarms(settings, rng.normal(-3.0, 1.0, 60))
    assert not any(reported[:19])
    assert all(reported[19:])


def test_one_impossible_step_is_no_alarm():
    rng = np.random.default_rng(0)
    settings = learn_alarm([rng.normal(2.0, 0.5, 100) for _ in range(5)], 20)
    fits = rng.normal(2.0, 0.5, 60)
    fits[30] = -1e6
    assert not any(alarms(settings, fits))


def test_one_odd_performance_widens_the_margin():
    rng = np.random.default_rng(0)
    alike = [rng.normal(2.0, 0.5, 100) for _ in range(5)]
    odd = [*alike[:4], alike[4] - 1.5]
    assert learn_alarm(odd, 20).threshold < learn_alarm(alike, 20).threshold - 0.5


def test_a_step_that_is_probably_unknown_fits_badly():
    fits = fit_of(np.array([1.0, 1.0]), np.array([0.0, 0.999]))
    assert fits[0] == 1.0
    assert fits[1] < -5.0


def test_of_one_performance_the_threshold_is_four_deviations_of_its_windows_below_their_mean():
    fits = np.random.default_rng(0).normal(2.0, 0.3, 400)
    windows = np.convolve(fits, np.full(20, 1 / 20), mode="valid")
    settings = learn_alarm([fits], 20)
    assert settings.threshold == pytest.approx(windows.mean() - 4.0 * windows.std(), abs=0.02)


def test_of_two_performances_the_threshold_is_a_prediction_bound_for_a_third():
    # Each at a level of its own, so that its windows are all alike.
    levels = np.array([1.0, 1.9])
    settings = learn_alarm([np.full(60, level) for level in levels], 20)
    student_90 = 3.078
    bound = levels.mean() - student_90 * levels.std(ddof=1) * np.sqrt(1 + 1 / 2)
    assert bound < levels.mean() - 4 * levels.std()
    assert settings.threshold == pytest.approx(bound)


def test_a_bound_from_many_performances_holds_for_nine_in_ten_others():
    rng = np.random.default_rng(3)
    kept = []
    for _ in range(400):
        levels = rng.normal(0.0, 1.0, 5)
        threshold = learn_alarm([np.full(30, 100.0 * level) for level in levels[:4]], 20).threshold
        kept.append(100.0 * levels[4] > threshold)
    # The margin of four deviations adds to it.
    assert np.mean(kept) > 0.9
