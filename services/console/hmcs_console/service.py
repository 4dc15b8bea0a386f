"""The service: what is heard is kept, what is kept is drawn, what the page does is sent.

Handlers of the bus only keep the newest. Drawing has a thread of its own, questions have theirs,
and what viewers do is put down by the page's threads and taken here.
"""

from __future__ import annotations

import logging
import time
from functools import partial
from typing import ClassVar

from hmcs.bus.keys import ANY, Member
from hmcs.bus.messages import (
    Ask,
    Health,
    Label,
    Record,
    RobotDescription,
    TrainingProgress,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Answer, Bus, Received
from hmcs.bus.verbs import HEALTH, LOOKS
from hmcs.fixtures.controller.rules import rules_of
from hmcs.recognizer_takeover import Question
from hmcs.task import Task
from hmcs_console.asking import Asking, first_of
from hmcs_console.describing import Describing
from hmcs_console.fetching import Fetching
from hmcs_console.operating.handles import Stopped
from hmcs_console.operating.stopping import Stopping
from hmcs_console.order import order_of
from hmcs_console.requesting import Requesting
from hmcs_console.seeing.history import EVERY_S
from hmcs_console.seeing.listening import Listening
from hmcs_console.seeing.marking import Marking, pressed
from hmcs_console.seeing.models import Models, load_models, task_of
from hmcs_console.seeing.presence import Presence
from hmcs_console.seeing.reports import Reports
from hmcs_console.seeing.seen import Picture, Seen
from hmcs_console.seeing.shelf import Shelf
from hmcs_console.serving.encryption import encryption
from hmcs_console.serving.gateway import Gateway, Served
from hmcs_console.serving.hands import FLOOD, Hands
from hmcs_console.serving.page import Page
from hmcs_console.serving.painter import Painter
from hmcs_console.settings import ConsoleSettings
from hmcs_console.teaching import requests
from hmcs_console.teaching.recordings import Recordings
from hmcs_console.teaching.swapping import Swapping
from hmcs_console.view import View

TAKE_EVERY_S = 0.01
"""How often what viewers did is taken, and leases are looked at."""
HANDLE_HZ = 30.0
"""How often a held handle is sent, however seldom the page is drawn: one that is silent for longer
than a few of these counts as let go."""
_EVERYBODY = Member(ANY, ANY)
HEALTH_EVERY_S = 2.0
DESCRIBE_EVERY_S = 1.0
FETCH_EVERY_S = 0.5
WATCH_EVERY_S = 0.1
"""How often is looked at how a newcomer among the recognizers does."""
UNWATCHED_EVERY_S = 1.0
"""How often is drawn while nobody looks, so that who comes sees how it is."""


class Console(Service):
    """The operator's page: shows everything there is on the bus, and can do everything."""

    name: ClassVar[str] = "console"
    Settings = ConsoleSettings

    def __init__(self, settings: ConsoleSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        models = load_models(settings.models)
        task = task_of(settings.task, models)
        self._seen = Seen(() if task is None else tuple(state.name for state in task.states))
        self._labels = bus.publisher(Label, bus.keys.label)
        self._asking = Asking(bus)
        self._stopping = Stopping(bus)
        self._requesting = Requesting(bus, self._seen, self._asking)
        self._swapping = Swapping(self._seen, self._requesting.request, settings.compare_s)
        self.recordings = Recordings(
            self._asking,
            bus.keys,
            lambda service: first_of(service, self._seen.members),
            lambda act: self.page.put(act),
        )
        """What is shown of recordings, and how their labels are set."""
        self._seen.marking = Marking(
            None if task is None else order_of(task), task is None or not _cued(task)
        )
        self._describing = Describing(self._asking, self._seen, self.recordings.list)
        self._unwatched_until_s = 0.0
        # A trainer finds a task by the console's setting, a file's path or a shipped name.
        taught = settings.task or ("" if task is None else task.name)
        known = Models(models, settings.models, log)
        self._fetching = Fetching(self._asking, self._seen, known)
        self._view = View(known, Shelf(settings.models), task, taught, self, settings.lease_s, log)
        try:
            self._gateway = Gateway(
                served(settings),
                self.page.server,
                log,
                self._count_refused,
                Reports(settings.models),
            )
        except BaseException:
            self.page.close()
            self._asking.close()
            self._stopping.close()
            raise
        self._hands = Hands(self.page, bus, settings.lease_s, log, self._stop_everybody)
        self._painter: Painter[Picture] = Painter(self._view.draw, settings.rate_hz, log)

    def start(self) -> None:
        """Listen to everybody, and let viewers operate."""
        bus, keys, seen = self.bus, self.bus.keys, self._seen
        Listening(bus, seen, self.log, self._on_mark)
        bus.subscribe(TrainingProgress, keys.training, self._on_training)
        Presence(bus, seen, self.log, self._on_process)
        bus.every(TAKE_EVERY_S, self._take)
        bus.every(1 / HANDLE_HZ, self._hands.tell_handle)
        bus.every(1 / self.settings.rate_hz, self._show)
        bus.every(EVERY_S, lambda: seen.write_down(time.monotonic()))
        bus.every(HEALTH_EVERY_S, self._ask_health)
        bus.every(DESCRIBE_EVERY_S, self._describing.ask)
        bus.every(FETCH_EVERY_S, self._fetching.ask)
        bus.every(WATCH_EVERY_S, self._swapping.watch)
        self.log.info("page", extra={"url": self.url})

    @property
    def page(self) -> Page:
        """The page, and what its viewers do."""
        return self._view.page

    @property
    def answer(self) -> str:
        """What came of the last thing that was asked for on the page."""
        return self._seen.answer

    @property
    def url(self) -> str:
        """Where the page is served; a token is not in it."""
        host = "127.0.0.1" if self.settings.host in ("0.0.0.0", "::") else self.settings.host
        scheme = "http" if self.settings.page_certificate is None else "https"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{self._gateway.port}"

    def health(self) -> tuple[bool, str]:
        """Healthy unless drawing fails."""
        if self._painter.failure:
            return False, f"cannot draw, see the log: {self._painter.failure}"
        operator = self._hands.operating.operator
        viewers = self.page.viewers
        return True, (
            f"{viewers} {'viewer' if viewers == 1 else 'viewers'} at {self.url}, "
            f"{self._painter.rate_hz:.0f} Hz, {operator or 'nobody'} operates"
        )

    def facts(self) -> dict[str, str]:
        """Say where the page is."""
        return {"page": self.url}

    def close(self) -> None:
        """Let go of the robot, and send viewers away."""
        self._hands.let_go()
        self._gateway.close()
        self._painter.close()
        self.page.close()
        self._asking.close()
        self._stopping.close()

    # --- what the page asks for; on its threads ---------------------------------------------------

    def stop(self) -> None:
        """Let every robot stand: operators of this page have let go, and others are overruled."""
        self.page.put(Stopped())

    def ask(self, question: Question) -> None:
        """Have a process do something."""
        self.page.put(partial(self._ask, question))

    def refuse(self, reason: str) -> None:
        """Say why nothing is asked for."""
        self.page.put(partial(self._tell, reason))

    def take_over(self) -> None:
        """Have the fixture follow what was trained last, once it was compared."""
        self.page.put(self._swapping.take_over)

    def activate_now(self) -> None:
        """Have the fixture follow it without comparing it any longer."""
        self.page.put(self._swapping.activate_now)

    def back(self) -> None:
        """Have the fixture follow the recognizer that was active before."""
        self.page.put(self._swapping.back)

    def label(self, state: str) -> None:
        """Say in which state the hand is from now on."""
        self.page.put(partial(self._label, state))

    @property
    def marks_by_pedal(self) -> bool:
        """Whether the pedal begins the next part of the task."""
        return self._seen.marking.by_pedal

    def mark_by_pedal(self, on: bool) -> None:
        """Let the pedal begin the next part of the task, or not."""

        def change() -> None:
            self._seen.marking = self._seen.marking._replace(by_pedal=on)

        self.page.put(change)

    # --- operating --------------------------------------------------------------------------------

    def _take(self) -> None:
        """Do what viewers want, end what has lapsed."""
        self._hands.take()
        self._asking.take()
        self._stopping.take()

    def _stop_everybody(self) -> None:
        robots = [member for member in self._seen.members if member.service == "robot"]
        self._stopping.stop_everybody(robots, self._tell)

    def _show(self) -> None:
        now_s = time.monotonic()
        watched = self.page.viewers > 0 or now_s >= self._unwatched_until_s
        if watched and self._painter.due(now_s):
            self._unwatched_until_s = now_s + UNWATCHED_EVERY_S
            operating = self._hands.operating
            picture = self._seen.picture(now_s, operating.operator, operating.lease.client)
            self._painter.show(
                now_s, picture._replace(take=self.recordings.take, lost=dict(self._hands.lost))
            )

    def _ask(self, question: Question) -> None:
        if isinstance(question.body, Record):
            # A new recording begins with nothing marked.
            self._seen.marking = self._seen.marking._replace(now="")
        self._tell(f"asking {question.service} to {question.verb} …")
        self._requesting.request(question, self._tell, self._tell)

    def _label(self, state: str) -> None:
        self._say(requests.label(state, self._seen.clock, self._seen.step))

    def _on_mark(self, clock: str, step: int) -> None:
        marking = pressed(self._seen.marking)
        if marking is not None:
            self._say(Label(state=marking.now, clock=clock, step=step))

    def _say(self, label: Label) -> None:
        self._labels.put(label)
        self._seen.marking = self._seen.marking._replace(now=label.state)
        self._tell(f"labeled {label.state or 'nothing'} from step {label.step} on")

    def _tell(self, answer: str) -> None:
        self._seen.answer = answer

    def _count_refused(self, reason: str) -> None:
        self.bus.counters.count_refused(FLOOD, reason)

    # --- listening --------------------------------------------------------------------------------

    def _on_training(self, received: Received[TrainingProgress]) -> None:
        self._seen.training = received.body

    def _on_process(self, member: Member) -> None:
        if member.service == "robot":
            self._asking.ask(LOOKS, member, Ask(), self._on_looks, timeout_s=5.0)

    def _on_looks(self, answers: list[Answer[RobotDescription]]) -> None:
        for answer in answers[:1]:
            self._seen.robot_description = answer.body

    def _ask_health(self) -> None:
        if self.page.viewers:
            self._asking.ask(HEALTH, _EVERYBODY, Ask(), self._on_health, timeout_s=0.5)

    def _on_health(self, answers: list[Answer[Health]]) -> None:
        reported = {
            Member(answer.envelope.source.service, answer.envelope.source.instance): answer.body
            for answer in answers
        }
        there = self._seen.members
        self._seen.health = {
            member: health for member, health in reported.items() if member in there
        }


def served(settings: ConsoleSettings) -> Served:
    """Return where and how the page is served.

    Raises UserError for a certificate or a key that cannot be used.
    """
    encrypted = None
    if settings.page_certificate is not None and settings.page_key is not None:
        encrypted = encryption(settings.page_certificate, settings.page_key)
    token = settings.token.get_secret_value() if settings.token is not None else None
    return Served(settings.host, settings.port, token, settings.page_names, encrypted)


def _cued(task: Task) -> bool:
    """Whether the pedal is a cue to the fixture in some state of a task."""
    rules = rules_of(task)
    return any(rules.in_state(state.name).fixture.compliance == "cue" for state in task.states)
