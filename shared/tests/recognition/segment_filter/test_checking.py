"""Knowledge the filter cannot compute with is refused by the name of what is wrong with it."""

import numpy as np
import pytest

from hmcs.recognition.segment_filter.checking import check_filter_settings, check_segment_filter
from hmcs.recognition.segment_filter.filter import FilterSettings


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"drop_below": 0.2}, "drop_below"),
        ({"drop_below": -1e-9}, "drop_below"),
        ({"recover": 0.9999}, "recover"),
        ({"abandon": 0.0}, "abandon"),
        ({"abandon": 0.6}, "abandon"),
        ({"unknown_after": 0.0}, "unknown_after"),
        ({"again": 1.1}, "again"),
        ({"any_state": 0.7, "unknown_after": 0.4}, "any_state . unknown_after"),
        ({"any_state": float("nan")}, "any_state"),
    ],
)
def test_settings_that_are_no_probabilities_or_lead_nowhere_are_refused(changed, says):
    check_filter_settings(FilterSettings())
    with pytest.raises(ValueError, match=says):
        check_filter_settings(FilterSettings()._replace(**changed))


@pytest.mark.parametrize("variant", [1, -1])
def test_a_phase_of_a_variant_that_is_none_is_refused(model, variant):
    check_segment_filter(model.knowledge, model.task)
    parameters = model.knowledge.parameters
    assert parameters.ends.shape[1] == 1
    wrong = parameters._replace(variant=np.full_like(parameters.variant, variant))
    with pytest.raises(ValueError, match="variant"):
        check_segment_filter(model.knowledge._replace(parameters=wrong), model.task)
