"""`hmcs deploy`: a new model takes over while the operator moves, and the one before can come back.

The newcomer runs as a shadow first: it replays the last steps, is compared with the active
recognizer for a while, and only then does the fixture follow it. The old one goes afterwards, if
`hmcs deploy` had brought it; the layered stack of compose.yaml stays.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationError

from hmcs.bus.keys import ANY
from hmcs.bus.messages import Ask, Belief, Description
from hmcs.bus.session import Bus, Received
from hmcs.errors import UserError
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.whole_files import written_whole
from hmcs_local import swap
from hmcs_local.control import Control

READY_WITHIN_S = 15.0
SERVICE = "recognizer"
_LOOK_EVERY_S = 0.05


class DeployError(UserError):
    """A model that was not activated; what was active is active still."""


class Deployed(BaseModel):
    """A model that was active, and where it came from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    model: str
    path: str = ""
    """Of its file; empty where it was not deployed but part of the stack."""
    instance: str = ""
    """Of the recognizer that runs it; empty where it is part of the stack."""


class History(BaseModel):
    """What was deployed in a folder, oldest first; the last one is active."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    deployed: tuple[Deployed, ...] = ()


class Agreement(NamedTuple):
    """A shadow beside the active recognizer."""

    steps: int
    """Both said something of."""
    alike: int
    """With the same likely state."""

    def __str__(self) -> str:
        if not self.steps:
            return "the hand did not move: nothing could be compared"
        return f"the same likely state in {self.alike} of {self.steps} steps"


def read_history(folder: Path) -> History:
    """Return what was deployed in the folder of `hmcs up`.

    Raises DeployError where the file that says so cannot be understood.
    """
    file = _history_file(folder)
    if not file.is_file():
        return History()
    try:
        return History.model_validate_json(file.read_text(encoding="utf-8"))
    except (ValidationError, OSError) as error:
        raise DeployError(f"{file}: cannot be understood, remove it: {error}") from None


def write_history(folder: Path, history: History) -> None:
    """Write what was deployed, whole or not at all."""
    with written_whole(_history_file(folder)) as unfinished:
        unfinished.write_text(history.model_dump_json(indent=2), encoding="utf-8")


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

    Raises DeployError where it bears the name of the active one, ModelFileError for its file,
    SwapError where it does not become ready, and ControlError as `hmcs swap` does.
    """
    model, history = load_model(file), read_history(folder)
    active = active_model(bus)
    if model.name == active:
        raise DeployError(
            f"{file}: is called {model.name!r}, as the active model is: train it under another "
            "name, with --name, so that both can run side by side"
        )
    now = _active(history, active)
    newcomer = _brought_up(bus, control, model, file, tell)
    agreement = watched(bus, active, model.name, watch_s)
    tell(f"beside {active}: {agreement}" if active else str(agreement))
    tell(swap.activate(bus, model.name))
    _let_go(control, now, tell)
    kept = [*history.deployed[:-1], now] if history.deployed else [now] if active else []
    deployed = Deployed(model=model.name, path=str(file.resolve()), instance=newcomer)
    write_history(folder, History(deployed=(*kept, deployed)))
    return agreement


def back(
    bus: Bus, control: Control, folder: Path, tell: Callable[[str], None] = lambda _: None
) -> str:
    """Return to the model that was active before; return its name.

    Raises DeployError where nothing was deployed before it.
    """
    history = read_history(folder)
    if len(history.deployed) < 2:
        raise DeployError(f"nothing to return to: no model was deployed in {folder.resolve()}")
    *older, before, now = history.deployed
    instance = before.instance
    if before.path and not control.owns(instance):
        file = Path(before.path)
        instance = _brought_up(bus, control, load_model(file), file, tell)
    tell(swap.activate(bus, before.model))
    _let_go(control, now, tell)
    returned = before.model_copy(update={"instance": instance})
    write_history(folder, History(deployed=(*older, returned)))
    return before.model


def active_model(bus: Bus) -> str:
    """Return the name of the recognizer the fixture follows; empty where it follows none.

    Raises DeployError where there is no fixture controller.
    """
    key = bus.keys.rpc("fixture_controller", ANY, "describe")
    answers = bus.ask(key, Ask(), Description)
    if not answers:
        raise DeployError(
            f"no fixture controller in cell {bus.settings.cell}: nothing follows a recognizer here"
        )
    return answers[0].body.facts.get("active_model", "")


def watched(bus: Bus, active: str, newcomer: str, watch_s: float) -> Agreement:
    """Return how two recognizers agreed while they ran side by side for so long."""
    said: dict[str, dict[tuple[str, int], str]] = {active: {}, newcomer: {}}

    def hear(received: Received[Belief]) -> None:
        belief = received.body
        name = received.key.split("/")[-2]
        if name in said:
            said[name][belief.clock, belief.step] = belief.likely_state

    bus.subscribe(Belief, bus.keys.belief(), hear)
    until_s = time.monotonic() + watch_s
    while time.monotonic() < until_s:
        bus.pump(_LOOK_EVERY_S)
    both = said[active].keys() & said[newcomer].keys()
    alike = sum(said[active][step] == said[newcomer][step] for step in both)
    return Agreement(len(both), alike)


def _active(history: History, active: str) -> Deployed:
    """The active model, as it was deployed, or as it stands in the stack."""
    if history.deployed and history.deployed[-1].model == active:
        return history.deployed[-1]
    return Deployed(model=active)


def _brought_up(
    bus: Bus, control: Control, model: Model, file: Path, tell: Callable[[str], None]
) -> str:
    """Lend a model's guides to the fixture, start its shadow and wait until it has replayed."""
    # Before it says anything: a belief of a model that is not loaded is refused.
    tell(swap.load(bus, str(file.resolve())))
    command = [sys.executable, "-m", f"hmcs_{SERVICE}", "--model", str(file.resolve())]
    instance = control.start(SERVICE, command)
    tell(f"{instance} started with {model.name} {model.hash}, a shadow until it is ready")
    member = bus.keys.member(model.name, SERVICE, instance)
    swap.until_ready(
        bus, control, instance, lambda: bool(bus.alive(member)), READY_WITHIN_S, "what was active"
    )
    tell(f"{instance} has replayed and is ready")
    return instance


def _let_go(control: Control, old: Deployed, tell: Callable[[str], None]) -> None:
    if old.instance and control.owns(old.instance):
        code = control.stop(old.instance)
        tell(f"{old.instance} stopped with exit code {code}")


def _history_file(folder: Path) -> Path:
    return folder / "deployed.json"
