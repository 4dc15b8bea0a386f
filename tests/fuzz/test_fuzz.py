"""A minute of hostile messages, always the same ones; `make fuzz` sends a million."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from fuzz.campaign import Besieged
from fuzz.hostile import payload
from hmcs.bus.messages import MESSAGES
from hmcs.bus.wire import RefusedMessageError, decode, envelope_of, schema_of
from support.stack import Stack


@pytest.mark.parametrize("message_type", MESSAGES, ids=schema_of)
def test_a_spoiled_message_is_refused_or_read_and_raises_nothing_else(message_type) -> None:
    draw = random.Random(schema_of(message_type))
    reasons = []
    for _ in range(600):
        data = payload(message_type, draw)
        try:
            decode(data, message_type)
        except RefusedMessageError as error:
            reasons.append(str(error))
            envelope_of(data, message_type)
    # Some are left good, so that what comes after decoding is met as well.
    assert 0 < len(reasons) < 600
    assert max(map(len, reasons)) < 2000


def test_no_process_of_the_stack_comes_to_harm_by_hostile_messages_and_questions(
    tmp_path: Path, model_file: Path, performance_file: Path
) -> None:
    with (
        Stack(tmp_path / "logs") as stack,
        Besieged(stack, tmp_path, model_file, performance_file) as besieged,
    ):
        verdict = besieged.siege(messages=3000, asked=150, seed=20261129)
        assert verdict.clean, verdict
        assert (verdict.messages, verdict.questions) == (3000, 150)
        refused = besieged.health("robot")
        assert refused is not None
        assert refused.refused["command"] > 0
