"""Answers beside the loop: slow ones take no place from quick ones."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

from hmcs.bus.answering import QUESTIONS_BOUND, Answering
from hmcs.bus.mailbox import Mailbox


def test_who_fills_the_place_of_slow_answers_leaves_that_of_the_others() -> None:
    answering = Answering(Mailbox(), lambda: False)
    go_on, answered = threading.Event(), threading.Event()
    with ThreadPoolExecutor(1) as slow:
        taken = [answering.submit(go_on.wait, slow) for _ in range(QUESTIONS_BOUND + 3)]
        assert taken == [True] * QUESTIONS_BOUND + [False] * 3
        assert answering.submit(answered.set)
        assert answered.wait(30.0)
        go_on.set()
        # What was answered leaves its place to others.
        deadline_s = time.monotonic() + 30.0
        while not answering.submit(answered.set, slow):
            assert time.monotonic() < deadline_s
    answering.close()
