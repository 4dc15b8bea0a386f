"""Questions to other processes, asked on threads of their own: an answer may take its time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from hmcs.bus.keys import Member
from hmcs.bus.messages import Done, Message
from hmcs.bus.session import Answer, Bus, RequestRefusedError, StoppedError
from hmcs.bus.verbs import Verb

Q = TypeVar("Q", bound=Message)
A = TypeVar("A", bound=Message)

_AT_ONCE = 2
WAITING = 8
"""So many requests may wait for what comes of them; a hand does not get that far."""
_MOST_ASKED = 32
"""So many other questions may wait for their turn or their answers; of more only a process that
comes and goes all the time makes some."""


class Asking:
    """Asks, and keeps what comes of it until `take` is called on the bus' own thread."""

    def __init__(self, bus: Bus, at_once: int = _AT_ONCE, waiting: int = WAITING) -> None:
        """Ask so many questions at once; the others wait for their turn.

        Of `waiting` requests that wait for an answer another one is refused.
        """
        self._bus = bus
        self._most_waiting = waiting
        self._asked = 0
        self._pool = ThreadPoolExecutor(at_once, thread_name_prefix="asking")
        self._come: deque[Callable[[], None]] = deque()
        self._waiting = 0

    def ask(
        self,
        verb: Verb[Q, A],
        member: Member,
        question: Q,
        then: Callable[[list[Answer[A]]], None],
        refused: Callable[[str], None] = lambda _: None,
        timeout_s: float = 1.0,
    ) -> None:
        """Ask a process, or all that `member` matches; hand what comes of it on with `take`."""
        most = self._most_waiting + _MOST_ASKED
        if self._asked == most:
            refused(f"{most} questions wait for an answer: wait for one before the next")
            return
        self._asked += 1

        def work() -> None:
            try:
                answers = verb.ask(
                    self._bus,
                    question,
                    service=member.service,
                    instance=member.instance,
                    timeout_s=timeout_s,
                )
            except StoppedError:
                return
            except RequestRefusedError as error:
                reason = str(error)
            except Exception as error:
                # Whatever the wire does, the asker hears of it and the next question is asked.
                reason = f"it could not be asked: {type(error).__name__}: {error}"
            else:
                self._come.append(lambda: then(answers))
                return
            self._come.append(lambda: refused(reason))

        self._pool.submit(work)

    def request(
        self,
        member: Member,
        verb: Verb[Q, Done],
        question: Q,
        done: Callable[[str], None],
        failed: Callable[[str], None] | None = None,
        timeout_s: float = 5.0,
    ) -> None:
        """Ask one process to do something; tell in one line what came of it.

        `failed` receives why it was not done, where it was not; by default `done` is.
        """
        failed = failed or done
        if self._waiting == self._most_waiting:
            most = self._most_waiting
            failed(f"{most} requests wait for an answer: wait for one before the next")
            return
        self._waiting += 1

        def come(answers: list[Answer[Done]]) -> None:
            self._waiting -= 1
            if answers:
                done(answers[0].body.detail)
            else:
                failed(f"{member.service} gave no answer to {verb.name}")

        def refused(reason: str) -> None:
            self._waiting -= 1
            failed(f"{member.service} refused: {reason}")

        self.ask(verb, member, question, come, refused, timeout_s)

    def take(self) -> None:
        """Hand on what has come."""
        while self._come:
            come = self._come.popleft()
            self._asked -= 1
            come()

    def close(self) -> None:
        """Wait for what is being asked; ask nothing more."""
        self._pool.shutdown(wait=True, cancel_futures=True)


def first_of(service: str, members: Iterable[Member]) -> Member | None:
    """Return the first process of a kind by name; None where there is none."""
    return min((member for member in members if member.service == service), default=None)
