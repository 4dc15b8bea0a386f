"""A stack of real processes under hostile messages and questions, and how it comes out of them."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import zenoh

from fuzz.hostile import published, questions
from hmcs.bus.config import BusSettings, client_config
from hmcs.bus.messages import Health
from support.stack import CELL, Stack
from support.taught import MODEL

BURST = 200
"""Messages sent at a time before the stack is looked at."""
ANSWERS_WITHIN_S = 30.0
_TRACEBACK = re.compile(r"Traceback \(most recent call last\)|panicked at|Fatal Python error")


class Verdict(NamedTuple):
    """What came of a campaign."""

    messages: int
    questions: int
    ended: tuple[str, ...]
    """Processes that ended."""
    silent: tuple[str, ...]
    """Processes that did not answer `health` in time, each once."""
    tracebacks: tuple[str, ...]
    """Log lines that tell of an exception nobody expected."""
    slowest_answer_s: float
    """Of all answers to `health`."""

    @property
    def clean(self) -> bool:
        """Whether nothing came to harm."""
        return not (self.ended or self.silent or self.tracebacks)


class Besieged:
    """Every service of the stack, each once, on a router of its own."""

    def __init__(self, stack: Stack, folder: Path, model_file: Path, performance: Path) -> None:
        self.stack = stack
        models = json.dumps([str(model_file.parent)])
        stack.watch(stack.open_bus("observer", "looks"))
        flags: dict[str, tuple[object, ...]] = {
            "robot": ("--task", MODEL),
            "gesteme_classifier": ("--model", model_file),
            "task_hmm": ("--model", model_file),
            "recognizer": (),
            "fixture_controller": ("--models", json.dumps([str(model_file)])),
            "recorder": ("--folder", folder / "recordings", "--no-autostart", "--models", models),
            "trainer": ("serve", "--folder", folder / "models"),
            "console": ("--port", "0", "--models", models),
            "input_device": (
                *("--task", MODEL, "--source", "recorded", "--demonstration", performance),
                *("--repeat", "0", "--re-engage"),
            ),
        }
        self.processes = {
            service: stack.start(service, f"{service.replace('_', '-')}-1", *words)
            for service, words in flags.items()
        }
        stack.until_ready(*self.processes.values(), within_s=120.0)
        settings = BusSettings(router=stack.endpoint, cell=CELL, connect_timeout_s=15.0)
        self._attacker = zenoh.open(client_config(settings))

    def __enter__(self) -> Besieged:
        return self

    def __exit__(self, *_: object) -> None:
        self._attacker.close()  # type: ignore[no-untyped-call]

    def siege(
        self,
        messages: int,
        asked: int,
        seed: int,
        progress: Callable[[int], None] = lambda _: None,
    ) -> Verdict:
        """Send hostile messages and ask hostile questions, and look after each burst."""
        instances = {service: process.instance for service, process in self.processes.items()}
        sent, put = published(CELL, MODEL, seed), 0
        to_ask = questions(CELL, instances, seed)
        silent: set[str] = set()
        slowest_s, asked_so_far = 0.0, 0
        while put < messages or asked_so_far < asked:
            for hostile in islice(sent, min(BURST, messages - put)):
                self._attacker.put(hostile.key, hostile.payload, attachment=hostile.attachment)
                put += 1
            share = asked if not messages else round(asked * put / messages)
            for hostile in islice(to_ask, max(share - asked_so_far, 0)):
                self._attacker.get(hostile.key, payload=hostile.payload, timeout=2.0)
                asked_so_far += 1
            for service, waited_s in self._answers():
                slowest_s = max(slowest_s, waited_s)
                if waited_s >= ANSWERS_WITHIN_S:
                    silent.add(service)
            progress(put)
            if len(silent) + len(self._ended()) >= len(self.processes):
                break
        return Verdict(
            put,
            asked_so_far,
            self._ended(),
            tuple(sorted(silent)),
            tuple(self._tracebacks()),
            slowest_s,
        )

    def health(self, service: str) -> Health | None:
        """Ask a service how it is; None where it does not answer in time."""
        return self.stack.health_within(self.processes[service], ANSWERS_WITHIN_S)

    def _answers(self) -> Iterator[tuple[str, float]]:
        for service, process in self.processes.items():
            if process.running:
                asked_s = time.monotonic()
                answered = self.health(service) is not None
                yield service, time.monotonic() - asked_s if answered else ANSWERS_WITHIN_S

    def _ended(self) -> tuple[str, ...]:
        return tuple(name for name, process in self.processes.items() if not process.running)

    def _tracebacks(self) -> Iterator[str]:
        for service, process in self.processes.items():
            for line in process.log_path.read_text(encoding="utf-8", errors="replace").splitlines():
                if _TRACEBACK.search(line):
                    yield f"{service}: {line[-600:]}"
