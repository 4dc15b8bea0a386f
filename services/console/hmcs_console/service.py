"""The service: what is heard is kept, what is kept is drawn, what the page does is told.

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
    Belief,
    FixtureState,
    Handle,
    Health,
    Label,
    Motion,
    RobotLooks,
    RobotState,
    Step,
    TrainingProgress,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Answer, Bus, Received
from hmcs_console import wishes
from hmcs_console.asking import Asking, first_of
from hmcs_console.gateway import Gateway
from hmcs_console.history import EVERY_S
from hmcs_console.models import Guides, load_models, task_of
from hmcs_console.operating import Operating, Outcome, Stopped, after, waited
from hmcs_console.page import Page
from hmcs_console.painter import Painter
from hmcs_console.seen import Picture, Seen
from hmcs_console.settings import ConsoleSettings
from hmcs_console.view import View
from hmcs_console.wishes import Question

TAKE_EVERY_S = 0.01
"""How often what viewers did is taken, and leases are looked at."""
HANDLE_HZ = 30.0
"""How often a held handle is told, however seldom the page is drawn: one that is silent for longer
than a few of these counts as let go."""
HEALTH_EVERY_S = 2.0
UNWATCHED_EVERY_S = 1.0
"""How often is drawn while nobody looks, so that who comes sees how it is."""
NS_PER_S = 1_000_000_000


class Console(Service):
    """The operator's page: shows everything there is on the bus, and can do everything."""

    name: ClassVar[str] = "console"
    Settings = ConsoleSettings

    def __init__(self, settings: ConsoleSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        models = load_models(settings.models)
        task = task_of(settings.task, models)
        self._seen = Seen(() if task is None else tuple(state.name for state in task.states))
        self._operating = Operating(bus.source.instance)
        self._handles = bus.publisher(Handle, bus.keys.handle)
        self._labels = bus.publisher(Label, bus.keys.label)
        self._asking = Asking(bus)
        self._unwatched_until_s = 0.0
        # A trainer finds a task by what the console was told, a file's path or a shipped name.
        taught = settings.task or ("" if task is None else task.name)
        self._view = View(Guides(models), task, taught, self, settings.lease_s, log)
        token = settings.token.get_secret_value() if settings.token is not None else None
        try:
            self._gateway = Gateway(
                settings.host, settings.port, self.page.server.get_port(), token
            )
        except BaseException:
            self.page.close()
            self._asking.close()
            raise
        self._painter: Painter[Picture] = Painter(self._view.draw, settings.rate_hz, log)

    def start(self) -> None:
        """Listen to everybody, and let viewers operate."""
        bus, keys, seen = self.bus, self.bus.keys, self._seen
        bus.subscribe(Motion, keys.motion, lambda got: seen.hand_moved(got.body))
        bus.subscribe(Step, keys.step, self._on_step)
        bus.subscribe(Belief, keys.belief(ANY), self._on_belief)
        bus.subscribe(
            FixtureState, keys.fixture_state, lambda got: seen.fixture_changed(_s(got), got.body)
        )
        bus.subscribe(RobotState, keys.robot_state, lambda got: seen.robot_moved(_s(got), got.body))
        bus.subscribe(TrainingProgress, keys.training, self._on_training)
        bus.watch(keys.presence(ANY, ANY), self._on_presence)
        bus.every(TAKE_EVERY_S, self._take)
        bus.every(1 / HANDLE_HZ, self._tell_handle)
        bus.every(1 / self.settings.rate_hz, self._show)
        bus.every(EVERY_S, lambda: seen.write_down(time.monotonic()))
        bus.every(HEALTH_EVERY_S, self._ask_health)
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
        return f"http://{f'[{host}]' if ':' in host else host}:{self._gateway.port}"

    def health(self) -> tuple[bool, str]:
        """Healthy unless drawing fails."""
        if self._painter.failure:
            return False, f"cannot draw, see the log: {self._painter.failure}"
        operator = self._operating.operator
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
        self._follow(after(self._operating, Stopped()))
        self._gateway.close()
        self._painter.close()
        self.page.close()
        self._asking.close()

    # --- what the page wishes; on its threads -----------------------------------------------------

    def stop(self) -> None:
        """Let the robot stand: whoever operates has let go."""
        self.page.put(Stopped())

    def ask(self, question: Question) -> None:
        """Have a process do something."""
        self.page.put(partial(self._ask, question))

    def take_over(self) -> None:
        """Have the fixture follow what was trained last."""
        self.page.put(self._take_over)

    def label(self, state: str) -> None:
        """Say in which state the hand is from now on."""
        self.page.put(partial(self._label, state))

    # --- operating --------------------------------------------------------------------------------

    def _take(self) -> None:
        """Do what viewers want, end what has lapsed."""
        for event in self.page.take_events():
            if callable(event):
                event()
            else:
                self._follow(after(self._operating, event))
        self._follow(waited(self._operating, time.monotonic(), self.settings.lease_s))
        self._asking.take()

    def _follow(self, outcome: Outcome) -> None:
        before, self._operating = self._operating, outcome.operating
        for handle in outcome.handles:
            self._handles.put(handle)
        for client, text in outcome.notices:
            self.page.tell(client, text)
        holder = self._operating.lease.client
        if holder != before.lease.client:
            self.page.hold(holder)
            operator = self._operating.operator
            self.log.info("operated" if operator else "let go", extra={"operator": operator})

    def _tell_handle(self) -> None:
        handle = self._operating.handle(time.monotonic())
        if handle is not None:
            self._handles.put(handle)

    def _show(self) -> None:
        now_s = time.monotonic()
        watched = self.page.viewers > 0 or now_s >= self._unwatched_until_s
        if watched and self._painter.due(now_s):
            self._unwatched_until_s = now_s + UNWATCHED_EVERY_S
            operating = self._operating
            self._painter.show(
                now_s, self._seen.picture(now_s, operating.operator, operating.lease.client)
            )

    def _take_over(self) -> None:
        questions = wishes.take_over(self._seen.training)
        if not questions:
            self._tell("nothing was trained yet: train first")
        else:
            self._ask(*questions)

    def _ask(self, question: Question, *more: Question) -> None:
        member = first_of(question.service, self._seen.members)
        if member is None:
            self._tell(f"no {question.service} is there to {question.verb}: start one")
        else:
            self._tell(f"asking {question.service} to {question.verb} …")
            self._asking.request(
                member,
                question.verb,
                question.body,
                self._tell,
                lambda: self._ask(*more) if more else None,
            )

    def _label(self, state: str) -> None:
        label = wishes.label(state, self._seen.clock, self._seen.step)
        self._labels.put(label)
        self._tell(f"labeled {state or 'nothing'} from step {label.step} on")

    def _tell(self, answer: str) -> None:
        self._seen.answer = answer

    # --- listening --------------------------------------------------------------------------------

    def _on_step(self, received: Received[Step]) -> None:
        self._seen.clock = received.envelope.source.boot
        self._seen.step = received.body

    def _on_belief(self, received: Received[Belief]) -> None:
        belief = received.body
        if len(belief.states) != len(belief.probabilities):
            self.bus.counters.count_refused(Belief.SCHEMA, "not one probability for each state")
            return
        before, after_name = self.bus.keys.belief(ANY).split(ANY)
        name = received.key.removeprefix(before).removesuffix(after_name)
        self._seen.believed(_s(received), name, belief)

    def _on_training(self, received: Received[TrainingProgress]) -> None:
        self._seen.training = received.body

    def _on_presence(self, key: str, alive: bool) -> None:
        member = self.bus.keys.member_of(key)
        if member == (self.name, self.bus.source.instance):
            return
        if not alive:
            self._seen.members.discard(member)
            self._seen.health.pop(member, None)
            return
        self._seen.members.add(member)
        if member.service == "robot":
            looks = self.bus.keys.rpc(member.service, member.instance, "looks")
            self._asking.ask(looks, Ask(), RobotLooks, self._on_looks, timeout_s=5.0)

    def _on_looks(self, answers: list[Answer[RobotLooks]]) -> None:
        for answer in answers[:1]:
            self._seen.looks = answer.body

    def _ask_health(self) -> None:
        if self.page.viewers:
            key = self.bus.keys.rpc(ANY, ANY, "health")
            self._asking.ask(key, Ask(), Health, self._on_health, timeout_s=0.5)

    def _on_health(self, answers: list[Answer[Health]]) -> None:
        told = {
            Member(answer.envelope.source.service, answer.envelope.source.instance): answer.body
            for answer in answers
        }
        there = self._seen.members
        self._seen.health = {member: health for member, health in told.items() if member in there}


def _s(received: Received[RobotState] | Received[FixtureState] | Received[Belief]) -> float:
    return received.received_ns / NS_PER_S
