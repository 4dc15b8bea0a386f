"""What becomes of a message on its way from bytes to its handler."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from hmcs.bus.counters import Counters
from hmcs.bus.examples import ENVELOPE
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Motion
from hmcs.bus.reading import Reader
from hmcs.bus.wire import encode


def numbered(seq: int) -> Arrival:
    motion = Motion(position=np.full(3, float(seq)), velocity=np.zeros(3), dead_man=True)
    return Arrival("key", encode(motion, ENVELOPE.model_copy(update={"seq": seq})), 0)


@pytest.mark.parametrize(
    ("keep_last", "handled", "late"), [(True, [0, 1, 2, 3], 2), (False, [0, 1, 2, 1, 0, 3], 0)]
)
def test_only_where_the_newest_wins_one_that_was_overtaken_is_late_and_not_handled(
    keep_last: bool, handled: list[int], late: int
) -> None:
    counters = Counters()
    reader = Reader(counters, RateLimitedLog(logging.getLogger("test")))
    read = [reader.read(Motion, numbered(seq), keep_last=keep_last) for seq in (0, 1, 2, 1, 0, 3)]
    assert [received.body.position[0] for received in read if received is not None] == handled
    assert counters.late["motion"] == late
    assert counters.received["motion"] == 6
    assert not counters.lost
