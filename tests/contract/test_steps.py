"""What travels as a step is what the science calls one."""

from __future__ import annotations

import numpy as np

from hmcs.bus import messages
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.wire import decode, encode
from hmcs.motion import steps

EXAMPLE = next(example for example in EXAMPLES if isinstance(example, messages.Step))


def test_a_step_has_the_same_fields_in_the_science_and_on_the_wire() -> None:
    assert steps.Step._fields == tuple(messages.Step.model_fields)
    for name, field in messages.Step.model_fields.items():
        required = name not in steps.Step._field_defaults
        assert field.is_required() == required, name
        assert required or field.default is steps.Step._field_defaults[name], name


def test_each_is_made_of_the_other_and_nothing_is_lost() -> None:
    step = steps.Step(**dict(EXAMPLE))
    _, body = decode(encode(messages.Step(**step._asdict()), ENVELOPE), messages.Step)
    for name in steps.Step._fields:
        np.testing.assert_array_equal(getattr(body, name), getattr(EXAMPLE, name))


def test_a_step_of_an_older_peer_has_no_further_senses() -> None:
    plain = messages.Step(index=0, position=np.zeros(3), displacement=np.ones(3))
    assert steps.Step(**dict(plain))[3:] == (None, None, False)
