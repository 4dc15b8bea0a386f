"""`hmcs deploy`: a new model takes over while the operator moves, and the one before can come back.

The newcomer runs as a shadow first: it replays the last steps, is compared with the active
recognizer for a while, and only then does the fixture follow it. The old one goes afterwards, if
`hmcs deploy` had brought it; the layered stack of compose.yaml stays. A newcomer that does not take
over, whatever the reason, is stopped again.
"""

from __future__ import annotations

import fcntl
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hmcs.bus.keys import Member, recognizer_in
from hmcs.bus.messages import Ask, Belief
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.bus.verbs import DESCRIBE
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognizer_takeover import (
    NOTHING_COMPARED,
    Agreement,
    SameNameError,
    Shadows,
    check_names_differ,
)
from hmcs.shown import plain
from hmcs_local import swap
from hmcs_local.control import Control
from hmcs_local.deployments import Deployed, DeployError, History, read_history, write_history
from hmcs_local.observer import speakers

READY_WITHIN_S = 15.0
SERVICE = "recognizer"
_LOOK_EVERY_S = 0.05


def deploy(
    bus: Bus,
    control: Control,
    folder: Path,
    file: Path,
    *,
    watch_s: float,
    tell: Callable[[str], None] = lambda _: None,
) -> Agreement:
    """Let a model's recognizer take over; return how it agreed with the one that was active.

    Raises DeployError where it bears the name of the active one, or another model of its name is
    run already; ModelFileError for its file, SwapError where it does not become ready or a fixture
    refuses it, and ControlError as `hmcs swap` does. PartlySwappedError is raised where some
    fixtures follow it and others do not answer: the old one goes on then, too.
    """
    model = load_model(file)
    with _alone(control, folder):
        active = active_model(bus)
        try:
            check_names_differ(model.name, active)
        except SameNameError as error:
            raise DeployError(f"{file}: {error}, with `hmcs train --name`") from None
        history = _settled(read_history(folder), active, control, tell)
        now = _active(history, active)
        kept = [*history.deployed[:-1], now] if history.deployed else [now] if active else []
        with _shadow(bus, control, folder, history, model, file, tell) as newcomer:
            agreement = watched(bus, active, model.name, watch_s)
            still = "" if agreement.compared else "the hand did not move: "
            tell(f"beside {active}: {still}{agreement}" if active else f"{still}{agreement}")
            _take_over(bus, folder, History(deployed=(*kept, newcomer)), tell)
        _let_go(control, now, tell)
    return agreement


def back(
    bus: Bus, control: Control, folder: Path, tell: Callable[[str], None] = lambda _: None
) -> str:
    """Return to the model that was active before; return its name.

    Raises DeployError where nothing was deployed before it, and what `deploy` raises.
    """
    with _alone(control, folder):
        history = _settled(read_history(folder), active_model(bus), control, tell)
        if len(history.deployed) < 2:
            raise DeployError(f"nothing to return to: no model was deployed in {folder.resolve()}")
        *older, before, now = history.deployed
        if before.path and not _runs(control, before):
            file = Path(before.path)
            model = load_model(file)
            with _shadow(bus, control, folder, history, model, file, tell) as returned:
                _take_over(bus, folder, History(deployed=(*older, returned)), tell)
        else:
            _take_over(bus, folder, History(deployed=(*older, before)), tell)
        _let_go(control, now, tell)
    return before.model


def active_model(bus: Bus) -> str:
    """Return the name of the recognizer the fixture follows; empty where it follows none.

    Raises DeployError where there is no fixture controller, or several follow different ones.
    """
    followed = _followed(bus)
    if not followed:
        raise DeployError(
            f"no fixture controller in cell {bus.settings.cell}: nothing follows a recognizer here"
        )
    if len(set(followed.values())) > 1:
        models = ", ".join(
            f"{fixture} {plain(model) or 'none'}" for fixture, model in sorted(followed.items())
        )
        raise DeployError(
            f"fixture controllers follow different models ({models}): let all follow one first, by "
            "`hmcs swap --activate MODEL`"
        )
    return next(iter(followed.values()))


def _followed(bus: Bus) -> dict[str, str]:
    """Return the model that each fixture controller follows, empty for none, by instance."""
    answers = DESCRIBE.ask(bus, Ask(), service="fixture_controller")
    return {
        source.instance: answer.body.facts.get("active_model", "")
        for answer in answers
        if (source := answer.envelope.source).service == "fixture_controller"
    }


def watched(bus: Bus, active: str, newcomer: str, watch_s: float) -> Agreement:
    """Return how two recognizers agreed while they ran side by side for so long."""
    shadows = Shadows(steps=None)

    def hear(received: Received[Belief]) -> None:
        belief = received.body
        name = recognizer_in(received.key).model
        if name in (active, newcomer):
            shadows.heard(name, belief.clock, belief.step, belief.likely_state)

    bus.subscribe(Belief, bus.keys.belief(), hear)
    until_s = time.monotonic() + watch_s
    while time.monotonic() < until_s:
        bus.pump(_LOOK_EVERY_S)
    return shadows.agreement(active).get(newcomer, NOTHING_COMPARED)


def _active(history: History, active: str) -> Deployed:
    """The active model, as it was deployed, or as it stands in the stack."""
    if history.deployed and history.deployed[-1].model == active:
        return history.deployed[-1]
    return Deployed(model=active)


@contextmanager
def _alone(control: Control, folder: Path) -> Iterator[None]:
    """Keep every other `hmcs deploy` of a folder out; raises DeployError where one is at work."""
    control.owns("")  # where no `hmcs up` works in the folder, nothing is begun
    with (folder / ".deploying").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DeployError(
                f"another `hmcs deploy` is at work in {folder.resolve()}: wait until it has ended"
            ) from None
        yield


def _settled(
    history: History, active: str, control: Control, tell: Callable[[str], None]
) -> History:
    """Return the history after a newcomer that a killed `hmcs deploy` may have left behind."""
    left = history.shadow
    if left is None:
        return history
    if left.model == active:
        return History(deployed=(*history.deployed, left))
    _let_go(control, left, tell)
    return History(deployed=history.deployed)


@contextmanager
def _shadow(
    bus: Bus,
    control: Control,
    folder: Path,
    history: History,
    model: Model,
    file: Path,
    tell: Callable[[str], None],
) -> Iterator[Deployed]:
    """Bring a model up as a shadow that has replayed; where the block fails, stop it again.

    Where somebody runs that very model already it is taken as it is, and left as it is. One that
    a fixture follows in the end goes on, whatever failed.
    """
    path = str(file.resolve())
    runner = _runner(bus, model)
    # Before it says anything: a belief of a model that is not loaded is refused.
    try:
        tell(swap.load(bus, path))
    except swap.PartlySwappedError as error:
        tell(f"not every fixture answers: {error}")
    if runner is not None:
        tell(f"{runner.instance} runs {model.name} {model.hash} already")
        yield Deployed(model=model.name, path=path)
        return

    def is_followed() -> bool:
        try:
            return model.name in _followed(bus).values()
        except Exception:  # who cannot be asked follows nobody
            return False

    command = [sys.executable, "-m", f"hmcs_{SERVICE}", "--model", path]
    newcomer = Deployed(model=model.name, path=path)
    try:
        with swap.started(control, SERVICE, command, keep=is_followed, tell=tell) as instance:
            newcomer = newcomer.model_copy(update={"instance": instance})
            write_history(folder, history.model_copy(update={"shadow": newcomer}))
            tell(f"{instance} started with {model.name} {model.hash}, a shadow until it is ready")
            member = bus.keys.member(model.name, SERVICE, instance)
            swap.until_ready(
                bus,
                control,
                instance,
                lambda: bool(bus.alive(member)),
                READY_WITHIN_S,
                "what was active",
            )
            tell(f"{instance} has replayed and is ready")
            yield newcomer
    except BaseException:
        if newcomer.instance and not control.owns(newcomer.instance):
            with suppress(DeployError):
                write_history(folder, history)
        raise


def _runner(bus: Bus, model: Model) -> Member | None:
    """Return who runs a model; None where nobody does, or who does is not answering.

    Raises DeployError where another model of the same name is run: two would speak as one.
    """
    for member in speakers(bus).get(model.name, ()):
        try:
            answers = DESCRIBE.ask(bus, Ask(), service=member.service, instance=member.instance)
        except RequestRefusedError:
            continue
        for answer in answers:
            if model.hash in answer.body.facts.get("model_hash", "").split(", "):
                return member
            raise DeployError(
                f"{member.instance} runs another model of the name {model.name!r}: stop it, or "
                "train yours under another name, with --name"
            )
    return None


def _take_over(bus: Bus, folder: Path, history: History, tell: Callable[[str], None]) -> None:
    """Let every fixture follow the last model of a history, and write that down."""
    try:
        tell(swap.activate(bus, history.deployed[-1].model))
    except swap.PartlySwappedError:
        write_history(folder, history)
        raise
    write_history(folder, history)


def _let_go(control: Control, old: Deployed, tell: Callable[[str], None]) -> None:
    if _runs(control, old):
        code = control.stop(old.instance)
        tell(f"{old.instance} stopped with exit code {code}")


def _runs(control: Control, deployed: Deployed) -> bool:
    """Whether it still runs: under its name, but in another `hmcs up`, something else may run."""
    return bool(deployed.instance) and deployed.path in control.command(deployed.instance)
