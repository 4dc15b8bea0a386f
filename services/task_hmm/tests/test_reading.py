"""Evidence that breaks the contract is refused with a reason; what keeps it is read whole."""

from types import SimpleNamespace

import numpy as np
import pytest

from hmcs.bus.messages import Evidence
from hmcs.recognition.segment_filter.gestemes import Scoring
from hmcs.recognition.segment_filter.recognizer import SegmentFilterModel
from hmcs_task_hmm.reading import UnusableEvidenceError, read_evidence

LAYERS = SegmentFilterModel(None, Scoring(0.0, 1.0, window_steps=10, prune_nats=30.0), None, None)
MODEL = SimpleNamespace(hash="abc", gesteme_names=("a", "b", "c"), knowledge=LAYERS)


def message(**changes):
    fields = {
        "model_hash": "abc",
        "clock": "boot",
        "step": 20,
        "gestemes": ("c", "a"),
        "pair_gesteme": np.array([0, 1, 0], dtype=np.int32),
        "pair_start": np.array([15, 15, 20], dtype=np.int32),
        "exit": np.array([0.25, 0.5, 0.0], dtype=np.float32),
        "log_ratio": np.array([1.0, -2.0, 3.0], dtype=np.float32),
    }
    return Evidence(**(fields | changes))


def test_pairs_are_read_with_indices_into_the_model():
    evidence = read_evidence(message(), MODEL)
    assert evidence.gestemes == (0, 2)
    assert evidence.pair_gesteme.tolist() == [2, 0, 2]
    assert evidence.pair_start.tolist() == [15, 15, 20]
    assert evidence.exit.tolist() == [0.25, 0.5, 0.0]
    assert evidence.log_ratio.dtype == np.float64


def test_evidence_without_a_pair_is_evidence():
    none = np.zeros(0)
    evidence = read_evidence(
        message(
            pair_gesteme=none.astype(np.int32),
            pair_start=none.astype(np.int32),
            exit=none,
            log_ratio=none,
        ),
        MODEL,
    )
    assert evidence.gestemes == (0, 2)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"model_hash": "other"}, "evidence of model other, expected abc: start the classifier"),
        ({"gestemes": ("c", "z")}, "each must be one of a, b, c"),
        ({"gestemes": ("c", "c")}, "once"),
        ({"exit": np.zeros(2, dtype=np.float32)}, "unequal lengths"),
        ({"pair_gesteme": np.array([0, 2, 0], dtype=np.int32)}, "does not hold"),
        ({"pair_gesteme": np.array([0, -1, 0], dtype=np.int32)}, "does not hold"),
        ({"pair_start": np.array([15, 15, 21], dtype=np.int32)}, "outside steps 11 to 20"),
        ({"pair_start": np.array([10, 15, 20], dtype=np.int32)}, "outside steps 11 to 20"),
        (
            {"pair_gesteme": np.array([0, 0, 0], dtype=np.int32)},
            "a pair comes twice",
        ),
        ({"exit": np.array([0.0, 1.5, 0.0], dtype=np.float32)}, "no probability"),
    ],
)
def test_what_breaks_the_contract_is_refused_with_the_reason(changes, reason):
    with pytest.raises(UnusableEvidenceError, match=reason):
        read_evidence(message(**changes), MODEL)
