"""Where science and wire meet for several services: what they say is said alike."""

from __future__ import annotations

from hmcs.bus import messages
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognition


def step_of(message: messages.Step) -> Step:
    """Return the step a message tells; their fields have the same names."""
    return Step(**dict(message))


def belief_message(model: Model, recognition: Recognition, clock: str) -> messages.Belief:
    """Return what is told of a recognition; `clock` is the boot of the input device."""
    belief = recognition.belief
    return messages.Belief(
        model_hash=model.hash,
        clock=clock,
        step=belief.step,
        states=model.state_names,
        probabilities=belief.states,
        unknown=belief.unknown,
        likely_gesteme=model.gesteme_names[belief.gesteme],
        segment_start=belief.segment_start,
        log_likelihood=belief.log_likelihood,
        mean_log_likelihood=recognition.mean_log_likelihood,
        unknown_alarm=recognition.unknown_alarm,
        missing_gestemes=tuple(model.gesteme_names[g] for g in belief.missing),
    )
