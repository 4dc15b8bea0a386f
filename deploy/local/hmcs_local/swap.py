"""`hmcs swap`: another recognizer, or a fresh classifier, while the stack runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from hmcs.bus.keys import ANY, KeyNameError, check_name
from hmcs.bus.session import Bus
from hmcs.errors import UserError
from hmcs.recognizer_takeover import Question, load_into_fixture
from hmcs.recognizer_takeover import activate as activation
from hmcs_local.asking import NobodyAnswersError, PartlyAnsweredError, asked_of
from hmcs_local.control import Control, ControlError
from hmcs_local.interrupts import uninterrupted
from hmcs_local.observer import speakers

CLASSIFIER = "gesteme_classifier"
_LOOK_EVERY_S = 0.05


class SwapError(UserError):
    """A swap that was not made; what ran before runs on."""


class PartlySwappedError(SwapError):
    """A swap that some fixtures have made, and others have not answered to."""


def activate(bus: Bus, model: str) -> str:
    """Let the fixture follow the belief of recognizer `model`; returns what the fixture answers.

    Raises SwapError where nobody runs that recognizer, no fixture controller is there, or one
    refuses; PartlySwappedError where some follow it and others do not answer.
    """
    try:
        check_name("model", model)
    except KeyNameError as error:
        raise SwapError(str(error)) from None
    running = speakers(bus)
    if model not in running:
        raise SwapError(
            f"nobody runs a recognizer of {model!r} in cell {bus.settings.cell}, so it would "
            f"assist nobody: start it first. Those that are run: {', '.join(running) or 'none'}"
        )
    return _asked(bus, activation(model))


def load(bus: Bus, path: str) -> str:
    """Let the fixture learn a model file's guides; returns what the fixture answers.

    The path is the fixture controller's own. Raises SwapError as `activate` does.
    """
    return _asked(bus, load_into_fixture(path))


def _asked(bus: Bus, question: Question) -> str:
    try:
        return asked_of(bus, question.verb, question.body, question.service)
    except PartlyAnsweredError as error:
        raise PartlySwappedError(str(error)) from None
    except NobodyAnswersError as error:
        raise SwapError(str(error)) from None


def replace_classifier(
    bus: Bus,
    control: Control,
    instance: str,
    *,
    command: Sequence[str] | None = None,
    ready_within_s: float = 10.0,
    tell: Callable[[str], None] = lambda _: None,
) -> str:
    """Start a fresh classifier, wait until it has replayed and is ready, stop `instance`.

    The newcomer is ready when its member token is there; until then the old one goes on, and if
    the newcomer is not ready in time it is stopped instead. Returns the newcomer's name.
    Raises SwapError where there is no such classifier or the newcomer is not ready in time, and
    ControlError where no `hmcs up` works in the folder of `control`.
    """
    members = _members(bus)
    if instance not in members:
        raise SwapError(
            f"no classifier {instance!r} at work in cell {bus.settings.cell}: "
            f"choose from {', '.join(sorted(members)) or 'none'}"
        )
    if not control.owns(instance):
        raise SwapError(
            f"{instance} was not started by the `hmcs up` of this folder: start its replacement "
            "where it belongs, wait until `hmcs status` shows it, then stop the old one"
        )
    with started(control, "gesteme-classifier", command, tell=tell) as newcomer:
        tell(f"{newcomer} started; {instance} goes on until it is ready")
        until_ready(
            bus, control, newcomer, lambda: newcomer in _members(bus), ready_within_s, instance
        )
    tell(f"{newcomer} has replayed and is ready")
    code = control.stop(instance)
    tell(f"{instance} stopped with exit code {code}")
    return newcomer


@contextmanager
def started(
    control: Control,
    service: str,
    command: Sequence[str] | None = None,
    *,
    keep: Callable[[], bool] = lambda: False,
    tell: Callable[[str], None] = lambda _: None,
) -> Iterator[str]:
    """Start a process and yield its name; where the block fails, whatever by, stop it again.

    It goes on nevertheless where `keep` then says that it is needed. Raises SwapError where it
    cannot be stopped, and ControlError where it cannot be started.
    """
    instance, interrupted = uninterrupted(lambda: control.start(service, command))
    try:
        if interrupted:
            raise KeyboardInterrupt
        yield instance
    except BaseException as error:
        if not keep():
            try:
                control.stop(instance)
            except ControlError as unstopped:
                raise SwapError(f"{error}; {instance} could not be stopped: {unstopped}") from error
            tell(f"{instance} is stopped again")
        raise


def until_ready(
    bus: Bus,
    control: Control,
    newcomer: str,
    is_ready: Callable[[], bool],
    within_s: float,
    old: str,
) -> None:
    """Wait until a process that was started is ready.

    Raises SwapError, which says that `old` goes on, where it ends or is not ready in time.
    """
    deadline_s = time.monotonic() + within_s
    while not is_ready():
        if time.monotonic() > deadline_s or not control.owns(newcomer):
            raise SwapError(
                f"{newcomer} was not ready within {within_s:g} s and is stopped; "
                f"{old} goes on. Its log says why: {newcomer}.log"
            )
        bus.pump(_LOOK_EVERY_S)


def _members(bus: Bus) -> set[str]:
    return {member.instance for member in bus.present(bus.keys.member(ANY, CLASSIFIER)).members}
