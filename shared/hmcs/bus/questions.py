"""Questions and answers between processes, by Zenoh's queries."""

from __future__ import annotations

import logging
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Generic, NamedTuple, TypeVar

import zenoh

from hmcs.bus.connecting import StoppedError
from hmcs.bus.keys import ANY
from hmcs.bus.messages import Envelope, Message, Refusal
from hmcs.bus.reading import Reader
from hmcs.bus.wire import RefusedMessageError, check_size, decode, encode
from hmcs.errors import UserError

A = TypeVar("A", bound=Message)
Q = TypeVar("Q", bound=Message)
T = TypeVar("T")

_LOOK_EVERY_S = 0.05


class RequestRefusedError(Exception):
    """A question that could not be answered; says what was wrong and what to do.

    Raised by a handler of `Bus.answer` to refuse, and by `Bus.ask` where the one asked refused.
    """


class Answer(NamedTuple, Generic[A]):
    """One reply to a question."""

    envelope: Envelope
    body: A


def replies_until_done(
    ask: Callable[[zenoh.handlers.Callback[zenoh.Reply]], None], stopping: Callable[[], bool]
) -> list[zenoh.Sample]:
    """Return what comes back to `ask(handler)`, once Zenoh says that all have replied or timed out.

    Raises StoppedError once `stopping` is true.
    """
    replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
    ask(zenoh.handlers.Callback(replies.put, lambda: replies.put(None), indirect=False))
    samples: list[zenoh.Sample] = []
    while True:
        if stopping():
            raise StoppedError
        try:
            reply = replies.get(timeout=_LOOK_EVERY_S)
        except Empty:
            continue
        if reply is None:
            return samples
        if reply.ok is not None:
            samples.append(reply.ok)


def read_answers(
    samples: list[zenoh.Sample],
    key: str,
    answer_type: type[A],
    reader: Reader,
    log: logging.Logger,
) -> list[Answer[A]]:
    """Return the answers among the replies to a question on `key`; refuses what is none.

    Raises RequestRefusedError where `key` names one process and that refused.
    """
    answers = []
    for sample in samples:
        data = b""
        try:
            check_size(len(sample.payload), answer_type, Refusal)
            data = sample.payload.to_bytes()
            answers.append(Answer(*decode(data, answer_type)))
        except RefusedMessageError as error:
            reason = _refusal_in(data)
            if reason is None:
                reader.refuse(answer_type.SCHEMA, str(sample.key_expr), error)
            elif ANY in key:
                log.info("question refused", extra={"key": str(sample.key_expr), "reason": reason})
            else:
                raise RequestRefusedError(reason) from None
    return answers


def reply(
    query: zenoh.Query,
    key: str,
    question_type: type[Q],
    handler: Callable[[Q], Message],
    reader: Reader,
    stamp: Callable[[], Envelope],
) -> None:
    """Reply to `query` with what `handler` makes of its question, or with a Refusal.

    An exception of `handler` that is neither RequestRefusedError nor UserError refuses as well and
    is raised again.
    """
    failure: Exception | None = None
    with query:
        try:
            payload = query.payload
            check_size(0 if payload is None else len(payload), question_type)
            _, question = decode(b"" if payload is None else payload.to_bytes(), question_type)
            answer = handler(question)
        except RefusedMessageError as error:
            reader.refuse(question_type.SCHEMA, key, error)
            answer = Refusal(reason=str(error))
        except (RequestRefusedError, UserError) as error:
            answer = Refusal(reason=str(error))
        except Exception as error:
            answer = Refusal(reason=f"{key}: failed unexpectedly, see the log of that process")
            failure = error
        query.reply(key, encode(answer, stamp()))
    if failure is not None:
        raise failure


def refuse_busy(query: zenoh.Query, key: str, stamp: Callable[[], Envelope]) -> None:
    """Reply to `query` that too many others wait already."""
    with query:
        query.reply(key, encode(Refusal(reason=f"{key}: too many questions at once"), stamp()))


def _refusal_in(data: bytes) -> str | None:
    try:
        return decode(data, Refusal)[1].reason
    except RefusedMessageError:
        return None
