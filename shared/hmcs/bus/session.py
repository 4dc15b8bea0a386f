"""Zenoh behind typed messages: open, publish, subscribe, ask, answer, presence.

Whatever arrives on Zenoh's threads is only put into a mailbox. Decoding, counting, refusing and
every handler run in the one thread that calls `Bus.pump`, so a service needs no locks. Questions
are decoded and answers encoded on a thread of their own; only the handler between the two runs in
the loop, or aside as well where an answer takes its time.
"""

from __future__ import annotations

import itertools
import logging
import secrets
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import Executor
from types import TracebackType
from typing import Self, TypeVar

import zenoh

from hmcs.bus.answering import Answering
from hmcs.bus.bounds import BOUNDS, LARGEST_PUBLISHED_BYTES
from hmcs.bus.config import BusSettings
from hmcs.bus.connecting import BusUnavailableError, StoppedError, connect
from hmcs.bus.counters import Counters
from hmcs.bus.keys import ANY, Keys, check_name
from hmcs.bus.links import Links
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.loop import Loop
from hmcs.bus.mailbox import Arrival, KeepAll, KeepLast, Listening, Mailbox
from hmcs.bus.messages import Envelope, Message, Origin, Source
from hmcs.bus.presence import Present, present
from hmcs.bus.publisher import Publisher, declare_publisher
from hmcs.bus.qos import profile_of
from hmcs.bus.questions import (
    Answer,
    RequestRefusedError,
    read_answers,
    refuse_busy,
    replies_until_done,
    reply,
)
from hmcs.bus.reading import Reader, Received
from hmcs.bus.rights import Rights, check_right
from hmcs.bus.timers import NS_PER_S, Timer, Timers
from hmcs.bus.tokens import TOKENS_BOUND, Token, TokenWatch, refuse_token
from hmcs.bus.wire import encode
from hmcs.bus.zenoh_callbacks import arrival_of, on_thread

__all__ = [
    "Answer",
    "Bus",
    "BusSettings",
    "BusUnavailableError",
    "Publisher",
    "Received",
    "RequestRefusedError",
    "StoppedError",
    "Timer",
    "Token",
]

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
R = TypeVar("R")


class Bus:
    """One process' place on the bus: one Zenoh session, closed by `with`."""

    @classmethod
    def open(
        cls,
        settings: BusSettings,
        service: str,
        instance: str,
        *,
        log: logging.Logger | None = None,
        stopping: Callable[[], bool] = lambda: False,
    ) -> Self:
        """Wait for a router and join its bus, saying every few seconds what is being waited for.

        Once `stopping` is true, StoppedError is raised here, in `ask` and in `alive`, and `pump`
        returns.
        Raises BusUnavailableError after `settings.connect_timeout_s` where that is set, and
        KeyNameError for a service or instance name that cannot be part of a key.
        """
        check_name("service", service)
        check_name("instance", instance)
        log = log or logging.getLogger("hmcs.bus")
        session = connect(settings, log, stopping)
        return cls(session, settings, service, instance, log, stopping)

    def __init__(
        self,
        session: zenoh.Session,
        settings: BusSettings,
        service: str,
        instance: str,
        log: logging.Logger,
        stopping: Callable[[], bool],
    ) -> None:
        self.settings = settings
        self.keys = Keys(settings.cell)
        self.source = Source(service=service, instance=instance, boot=secrets.token_hex(6))
        self.counters = Counters()
        self.rights: Rights | None = None
        """What may be declared on it; None refuses nothing."""
        self.publishes: list[str] = []
        self.subscribes: list[str] = []
        self.answers: list[str] = []
        self._session = session
        self._log = log
        self._stopping = stopping
        self._limited = RateLimitedLog(log)
        self._reader = Reader(self.counters, self._limited)
        self._mailbox = Mailbox()
        self._timers = Timers()
        self._loop = Loop(self._mailbox, self._timers, self.counters, stopping)
        self._answering = Answering(self._mailbox, stopping)
        self._numbers: defaultdict[str, itertools.count[int]] = defaultdict(itertools.count)
        # Zenoh undeclares what nobody holds.
        self._declared: list[object] = []
        self._links = Links(session, settings, log, self._mailbox)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the bus; a second time does nothing."""
        self._answering.close()
        if not self._session.is_closed():
            self._session.close()  # type: ignore[no-untyped-call]

    @property
    def connected(self) -> bool:
        """Whether the router (or, in direct mode, anybody) is reached now."""
        return self._links.connected

    # --- publish and subscribe --------------------------------------------------------------------

    def publisher(self, message_type: type[M], key: str) -> Publisher[M]:
        """Return a publisher of `message_type` on `key`, with the profile of the table in `qos`.

        A last chunk that stands for any instance becomes this process' own.
        """
        if key.endswith(f"/{ANY}"):
            key = key.removesuffix(ANY) + self.source.instance
        profile = profile_of(message_type)
        check_right(self.rights, "says", key)
        publisher = declare_publisher(self._session, key, profile)
        self.publishes.append(key)
        sender = self.source.boot.encode()
        return Publisher(publisher, self._stamps(key), self.counters, sender)

    def subscribe(
        self, message_type: type[M], key: str, handler: Callable[[Received[M]], None]
    ) -> None:
        """Hand every message on `key` to `handler`, or the newest of each key: see `qos`.

        What is no message of `message_type` is refused, counted and logged.
        """
        keep_last = profile_of(message_type).delivery == "keep_last"
        check_right(self.rights, "hears", key)
        # Each subscription follows sequence numbers by itself: it sees every message anew.
        reader = Reader(self.counters, self._limited)

        def handle(arrival: Arrival) -> None:
            received = reader.read(message_type, arrival, keep_last=keep_last)
            if received is not None:
                handler(received)

        box = (KeepLast if keep_last else KeepAll)(
            self._mailbox, handle, lambda: reader.overflowed(key)
        )
        largest_bytes = BOUNDS[message_type].size_bytes

        def arrive(sample: zenoh.Sample) -> None:
            box.arrive(arrival_of(sample, largest_bytes))

        self._declared.append(self._session.declare_subscriber(key, on_thread(arrive)))
        self.subscribes.append(key)

    def listen(self, key: str, handler: Callable[[Arrival], None], every_s: float = 0.02) -> None:
        """Hand everything on `key` to `handler` as it arrived, each one in order, undecoded.

        For observers who keep whatever there is and are in no hurry: they are handed what came
        together, every `every_s`, which costs a fraction of waking up for each. What finds no
        place to wait shows in the gap in its numbers, as all losses are.
        """
        check_right(self.rights, "hears", key)
        listening = Listening(handler, lambda: self._reader.overflowed(key))

        def arrive(sample: zenoh.Sample) -> None:
            listening.arrive(arrival_of(sample, LARGEST_PUBLISHED_BYTES))

        self.every(every_s, listening.hand_on)
        self._declared.append(self._session.declare_subscriber(key, on_thread(arrive)))
        self.subscribes.append(key)

    # --- questions --------------------------------------------------------------------------------

    def answer(
        self,
        verb: str,
        question_type: type[Q],
        handler: Callable[[Q], Message],
        *,
        aside: Executor | None = None,
    ) -> None:
        """Answer questions of `question_type` on this process' key of `verb`.

        Questions are decoded and answers encoded beside the loop; `handler` runs in the loop. An
        answer that takes long is made `aside`, on threads of its own, handler and all: what of it
        needs the loop's own state is done with `in_loop`. Where `handler` raises
        RequestRefusedError or UserError the asker gets a Refusal with its message; any other
        exception refuses as well and then leaves `pump`.
        """
        key = self.keys.rpc(self.source.service, self.source.instance, verb)
        check_right(self.rights, "answers", key)
        stamps = self._stamps(key)

        def handled(question: Q) -> Message:
            return handler(question) if aside else self.in_loop(lambda: handler(question))

        def arrive(query: zenoh.Query) -> None:
            def work() -> None:
                reply(query, key, question_type, handled, self._reader, stamps)

            if not self._answering.submit(work, aside):
                refuse_busy(query, key, stamps)

        self._declared.append(self._session.declare_queryable(key, on_thread(arrive)))
        self.answers.append(key)

    def in_loop(self, work: Callable[[], R]) -> R:
        """Do `work` in the thread that pumps and return what it gave, or raise what it raised.

        For handlers that answer aside. Raises LoopHangsError where the loop does not come round.
        """
        return self._answering.in_loop(work)

    def ask(
        self, key: str, question: Message, answer_type: type[M], timeout_s: float = 1.0
    ) -> list[Answer[M]]:
        """Ask all that answer on `key` and return every reply that came within `timeout_s`.

        Returns early once all have replied, at once where nobody is there. This process' own
        answers are left out. Replies that cannot be read are refused and counted.
        Raises RequestRefusedError where `key` names one process and that refused, and StoppedError
        where the process is stopped meanwhile.
        """
        check_right(self.rights, "asks", key)
        payload = encode(question, self._stamps(key)())

        def get(handler: zenoh.handlers.Callback[zenoh.Reply]) -> None:
            self._session.get(
                key,
                handler,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                allowed_destination=zenoh.Locality.REMOTE,
                timeout=timeout_s,
                payload=payload,
            )

        samples = replies_until_done(get, self._stopping)
        return read_answers(samples, key, answer_type, self._reader, self._log)

    # --- presence ---------------------------------------------------------------------------------

    def announce(self, key: str) -> Token:
        """Show `key` to everybody who watches, until it is withdrawn or this process is gone."""
        check_right(self.rights, "announces", key)
        token = Token(self._session.liveliness().declare_token(key))
        self._declared.append(token)
        return token

    def watch(self, key: str, handler: Callable[[str, bool], None]) -> None:
        """Call `handler` with each token's key as it comes (True) or goes (False).

        Those already there come first. A token that is only confirmed is not new; one with
        an impossible name is refused and counted.
        """
        check_right(self.rights, "watches", key)
        watch = TokenWatch(self.keys, handler, self.counters, self._limited)

        def arrive(sample: zenoh.Sample) -> None:
            token, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            self._mailbox.put(lambda: watch.change(token, alive))

        self._declared.append(
            self._session.liveliness().declare_subscriber(key, on_thread(arrive), history=True)
        )

    def alive(self, key: str, timeout_s: float = 1.0) -> list[str]:
        """Return the keys of the tokens on `key` that are there now, sorted.

        Those with an impossible name are left out and counted.
        """
        return list(self.present(key, timeout_s).tokens)

    def present(self, key: str, timeout_s: float = 1.0) -> Present:
        """Return who shows a token on `key` now; those with an impossible name are counted."""
        check_right(self.rights, "watches", key)
        samples = replies_until_done(
            lambda handler: self._session.liveliness().get(key, handler, timeout=timeout_s),
            self._stopping,
        )
        found = present(self.keys, (str(sample.key_expr) for sample in samples[:TOKENS_BOUND]))
        for token in found.strangers:
            refuse_token(token, self.counters, self._limited)
        return found

    # --- the loop ---------------------------------------------------------------------------------

    def every(self, period_s: float, handler: Callable[[], None]) -> Timer:
        """Call `handler` at a fixed rate, first after one period; missed ticks are skipped."""
        if not period_s > 0:
            raise ValueError(f"period_s is {period_s}, expected a positive number of seconds")
        period_ns = max(1, round(period_s * NS_PER_S))
        return self._timers.add(time.monotonic_ns() + period_ns, Timer(handler, period_ns))

    def at(self, monotonic_ns: int, handler: Callable[[], None]) -> Timer:
        """Call `handler` once, when the local monotonic clock reaches `monotonic_ns`."""
        return self._timers.add(monotonic_ns, Timer(handler, None))

    def soon(self, work: Callable[[], None]) -> None:
        """Do `work` in the thread that pumps, in its turn; from any thread."""
        self._mailbox.put(work)

    def pump(self, timeout_s: float) -> int:
        """Handle what is pending, in order of arrival, and timers when they are due.

        Waits at most `timeout_s` for something to do; returns how many things were handled. An
        exception of a handler leaves `pump`; whatever else is pending stays for the next call.
        """
        self._answering.note_loop()
        return self._loop.pump(timeout_s)

    def wake(self) -> None:
        """Let a waiting `pump` look around at once; from any thread or a signal handler."""
        self._mailbox.wake()

    def _stamps(self, key: str) -> Callable[..., Envelope]:
        numbers = self._numbers[key]
        source = self.source

        def stamp(origin: Origin | None = None) -> Envelope:
            return Envelope(source=source, seq=next(numbers), origin=origin)

        return stamp
