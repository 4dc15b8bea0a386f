"""The alarm: few false ones on motion like that it was learned from, and no single step decides."""

import numpy as np

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
    told = alarms(settings, rng.normal(-3.0, 1.0, 60))
    assert not any(told[:19])
    assert all(told[19:])


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
