"""Answers to questions, on threads of their own: the loop of a process runs the handlers alone.

A question is decoded and its answer encoded beside the loop, so that neither a large question nor
many of them hold up what the process is for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import TypeVar

from hmcs.bus.connecting import StoppedError
from hmcs.bus.mailbox import Mailbox
from hmcs.bus.questions import RequestRefusedError

T = TypeVar("T")

QUESTIONS_BOUND = 64
"""Questions that may wait for the same threads; more are refused at once. Those for other threads
are not: who fills the place of slow answers leaves that of the quick ones, health among them."""
LOOP_WITHIN_S = 2.0
"""A loop that has not come round for so long counts as hung."""
_THREADS = 4
"""A handler that waits for a hung loop must not keep the other questions waiting."""
_LOOK_EVERY_S = 0.1


class LoopHangsError(RequestRefusedError):
    """The loop of this process does not come round."""


class Answering:
    """Runs work beside the loop of a process, and the part of it that needs the loop within it."""

    def __init__(self, mailbox: Mailbox, stopping: Callable[[], bool]) -> None:
        self._mailbox = mailbox
        self._stopping = stopping
        self._threads = ThreadPoolExecutor(_THREADS, thread_name_prefix="answers")
        self._rooms: dict[Executor, threading.BoundedSemaphore] = {}
        self._rooms_lock = threading.Lock()
        self._loop_thread: int | None = None
        self._closed = False

    def note_loop(self) -> None:
        """Note that the calling thread is the one that pumps."""
        self._loop_thread = threading.get_ident()

    def submit(self, work: Callable[[], None], aside: Executor | None = None) -> bool:
        """Do `work` beside the loop, on the threads of `aside` where given.

        Returns False, and does nothing, where too much waits already. What it raises leaves the
        loop's `pump`.
        """
        threads = aside or self._threads
        with self._rooms_lock:
            room = self._rooms.setdefault(threads, threading.BoundedSemaphore(QUESTIONS_BOUND))
        if not room.acquire(blocking=False):
            return False
        try:
            done = threads.submit(work)
        except RuntimeError:
            # The process is ending and takes no more work.
            room.release()
            return False
        done.add_done_callback(lambda done: self._finished(done, room))
        return True

    def in_loop(self, work: Callable[[], T]) -> T:
        """Do `work` in the loop of this process and return what it gave, or raise what it raised.

        Raises LoopHangsError where the loop has not taken it up within `LOOP_WITHIN_S`, and
        StoppedError where the process ends meanwhile.
        """
        if threading.get_ident() == self._loop_thread:
            return work()
        result: Future[T] = Future()

        def run() -> None:
            if result.set_running_or_notify_cancel():
                try:
                    result.set_result(work())
                except BaseException as error:
                    result.set_exception(error)

        self._mailbox.put(run)
        until_s = time.monotonic() + LOOP_WITHIN_S
        while not (self._closed or self._stopping()):
            try:
                return result.result(_LOOK_EVERY_S)
            except FutureTimeoutError:
                if result.done():
                    raise
                if time.monotonic() > until_s and result.cancel():
                    raise LoopHangsError(
                        f"the loop of this process has not come round for {LOOP_WITHIN_S:g} s: it "
                        "hangs or has more to do than it can"
                    ) from None
        raise StoppedError

    def close(self) -> None:
        """Take no more work, and wait for none."""
        self._closed = True
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _finished(self, done: Future[None], room: threading.BoundedSemaphore) -> None:
        room.release()
        try:
            error = done.exception()
        except CancelledError:
            return
        if error is not None and not isinstance(error, StoppedError):
            self._mailbox.put(lambda: _raise(error))


def _raise(error: BaseException) -> None:
    raise error
