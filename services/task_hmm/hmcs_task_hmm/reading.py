"""Reading evidence: from a message to what the filter takes, or a reason why not."""

from __future__ import annotations

import numpy as np

from hmcs.bus.messages import Evidence
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter.recognizer import segment_filter_model


class UnusableEvidenceError(ValueError):
    """Evidence that breaks the contract; says how."""


def read_evidence(message: Evidence, model: Model) -> StepEvidence:
    """Return a classifier's evidence with indices into the model.

    Raises UnusableEvidenceError for another model's evidence, an unknown or repeated gesteme,
    arrays of unequal length, a start after the step or older than the window, a repeated pair, or
    an exit that is no probability.
    """
    if message.model_hash != model.hash:
        raise UnusableEvidenceError(
            f"evidence of model {message.model_hash}, expected {model.hash}: start the classifier "
            "with the same model file as the task"
        )
    names = model.gesteme_names
    strangers = [name for name in message.gestemes if name not in names]
    if strangers or len(set(message.gestemes)) != len(message.gestemes):
        raise UnusableEvidenceError(
            f"gestemes {', '.join(message.gestemes)}: each must be one of {', '.join(names)}, once"
        )
    lengths = {
        len(array)
        for array in (message.pair_gesteme, message.pair_start, message.exit, message.log_ratio)
    }
    if len(lengths) != 1:
        raise UnusableEvidenceError("the arrays of its pairs have unequal lengths")
    gestemes = np.array([names.index(name) for name in message.gestemes], dtype=np.int32)
    held, starts = message.pair_gesteme, message.pair_start
    if len(held) and not (held.min() >= 0 and held.max() < len(gestemes)):
        raise UnusableEvidenceError("a pair names a gesteme the classifier does not hold")
    oldest = message.step - segment_filter_model(model).scoring.window_steps
    if len(starts) and not (starts.min() > oldest and starts.max() <= message.step):
        raise UnusableEvidenceError(
            f"a pair starts outside steps {max(oldest + 1, 0)} to {message.step}"
        )
    if len(np.unique(held.astype(np.int64) << 32 | starts)) != len(held):
        raise UnusableEvidenceError("a pair comes twice")
    exits = np.asarray(message.exit, dtype=np.float64)
    if len(exits) and not (exits.min() >= 0.0 and exits.max() <= 1.0):
        raise UnusableEvidenceError("an exit is no probability")
    return StepEvidence(
        message.step,
        tuple(sorted(int(g) for g in gestemes)),
        gestemes[held],
        starts,
        exits,
        np.asarray(message.log_ratio, dtype=np.float64),
    )
