"""Model files that lie in the repository open and recognize as on the day they were made."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hmcs.recognition.model_file import load_model
from hmcs.recognition.registry import kinds, recognizer_of
from support.lessons import ROUND, steps_performed

KEPT = Path(__file__).parent / "kept"
"""One model of each kind, learned from the demonstrations of `support.lessons`."""
BELIEFS = json.loads((KEPT / "beliefs.json").read_text(encoding="utf-8"))
"""P(state) at every twentieth step, six digits, as each said it when it was made."""
EVERY = 20


def test_a_model_of_every_kind_is_kept() -> None:
    assert sorted(BELIEFS) == sorted(kind.name for kind in kinds())


@pytest.mark.parametrize("name", sorted(BELIEFS))
def test_a_kept_model_recognizes_as_it_did(name: str) -> None:
    model = load_model(KEPT / f"{name}.hmcs")
    assert model.recognizer == name
    recognizer = recognizer_of(model)
    steps = steps_performed(100, ROUND * 2)
    said = [recognizer.step(step).belief.states for step in steps][::EVERY]
    np.testing.assert_allclose(said, BELIEFS[name], rtol=0, atol=1e-5)
