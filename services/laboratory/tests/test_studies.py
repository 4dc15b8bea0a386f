"""Every registered study runs, and says what it is."""

import numpy as np
import pytest

from hmcs_laboratory.studies import STUDIES
from hmcs_laboratory.study import TIMINGS

SHARES = {
    "accuracy",
    "state_accuracy",
    "gesteme_accuracy",
    "boundary_f",
    "gestemes_right",
    "states_right",
    "exact",
    "direction_accuracy",
    "auc",
    "false_alarms",
    "detected",
    "unknown_in_task",
    "unknown_in_unknown",
    "calibration_error",
    "all_states_calibration_error",
}
MEASURES = {
    *SHARES,
    "adjusted_rand",
    "gesteme_adjusted_rand",
    "brier_score",
    "found",
    "true",
    "delay_median_steps",
    "delay_p95_steps",
    "false_switches_per_1000",
    *TIMINGS,
}

OF_METHODS = [study for study in STUDIES if "methods" in study.settings.model_fields]
"""All but those of assistance, which have tests of their own."""


@pytest.mark.parametrize("study", OF_METHODS, ids=lambda study: study.name)
def test_a_trial_measures_every_method_with_tiny_settings(study):
    settings = study.settings_from([f"{name}={value}" for name, value in study.tiny.items()])
    rows = study.trial(settings, np.random.default_rng(3))
    assert {row.method for row in rows} == set(settings.methods)
    for row in rows:
        assert {*TIMINGS} <= set(row.measures) <= MEASURES
        shares = [value for name, value in row.measures.items() if name in SHARES]
        assert shares
        # Shrinkage LDA cannot learn from one example of each gesteme.
        if (row.method, row.setting.get("training")) == ("lda", 1):
            assert np.isnan(list(row.measures.values())).all()
        else:
            assert all(0 <= share <= 1 for share in shares)
            assert row.measures["us_per_sample"] > 0


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_every_setting_is_explained_and_every_study_has_a_source(study):
    assert study.line
    assert study.source
    undocumented = {"gestemes", "kind", "dimensions", "training", "noise", "demonstrations"}
    for name, known in study.settings.model_fields.items():
        assert known.description or name in undocumented, name


@pytest.mark.parametrize("study", OF_METHODS, ids=lambda study: study.name)
def test_a_method_measures_the_same_alone_and_among_others(study):
    def rows(methods):
        given = {**study.tiny, "methods": methods}
        settings = study.settings_from([f"{name}={value}" for name, value in given.items()])
        return [
            (row.method, row.setting, {k: v for k, v in row.measures.items() if k not in TIMINGS})
            for row in study.trial(settings, np.random.default_rng(8))
        ]

    together = rows(study.tiny["methods"])
    last = study.tiny["methods"].split(",")[-1]
    np.testing.assert_equal(rows(last), [row for row in together if row[0] == last])


def test_names_of_studies_are_unique():
    assert len({study.name for study in STUDIES}) == len(STUDIES)
