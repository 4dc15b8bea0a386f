"""Page and recorder beside the fast loop: what the two hops cost with them, and what they cost.

Phases without them, with both, and with a viewer take turns in one run. The viewer is a chromium of
this machine where there is one: without graphics hardware it draws with what is left of the cores,
which costs the two hops more than page and recorder do. Usually it is on another machine.
"""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench.figures import Figure, percentile_ms, tell
from bench.whole_stack import SHAPES, cpu_s
from browser.conftest import BROWSERS, FLAGS
from hmcs.bus.keys import Member
from hmcs.bus.messages import Ask, Command, Description
from hmcs.bus.session import Bus, Received
from hmcs_local.processes import StackProcess
from hmcs_trainer.training import train
from support.stack import Stack
from support.stops import circles

RATIO = 1.15
CPU_SHARE = 0.15
"""Of a core, drawing 30 times a second."""
TURNS = 3
SLOW_S = 60.0
"""A console and a browser may take so long to come up on a busy machine."""
_SETTLED_S = 1.0
"""Of each phase, left out: processes come and go."""


def measure(span_s: float) -> list[Figure]:
    """Take turns, each phase so long."""
    with tempfile.TemporaryDirectory() as place, Stack(Path(place) / "logs") as stack:
        folder = Path(place)
        model = folder / "model.hmcs"
        train("human-shapes", [f"lasa:{shape}/1-2" for shape in SHAPES], model)
        bus = stack.open_bus("observer", "o")
        stack.watch(bus)
        commands: list[Received[Command]] = []
        bus.subscribe(Command, bus.keys.command, commands.append)
        stack.until_ready(
            stack.start("robot", "r"),
            stack.start("fixture_controller", "f", "--models", json.dumps([str(model)])),
            stack.start("recognizer", "r", "--model", model),
            stack.start(
                "input_device",
                "i",
                *("--source", "recorded", "--demonstration", circles(folder)),
                *("--rate-hz", 100, "--repeat", 0, "--lead-in-s", 0.4),
            ),
        )
        stack.until(lambda: any(r.body.engaged for r in commands))
        alone: list[int] = []
        unseen: list[int] = []
        seen: list[int] = []
        shares: list[float] = []
        rates: list[float] = []
        for turn in range(TURNS):
            alone += _delays(bus, commands, span_s)
            with _page_and_recorder(stack, folder, model, turn) as (console, url):
                unseen += _delays(bus, commands, span_s)
                with _viewer(url, folder / f"browser-{turn}") as looking:
                    if not looking:
                        continue
                    stack.until(lambda: " viewer " in stack.health(console).detail, SLOW_S)
                    (before_s,), began_s = cpu_s([console]), time.monotonic()
                    seen += _delays(bus, commands, span_s)
                    (after_s,), lasted_s = cpu_s([console]), time.monotonic() - began_s
                    shares.append((after_s - before_s) / lasted_s)
                    reported = stack.health(console).detail.split()
                    rates.append(float(reported[reported.index("Hz,") - 1]))
    floor_ms = percentile_ms(alone, 50)
    figures = [
        Figure("two hops without page and recorder, p50", floor_ms, "ms"),
        Figure("with both, nobody looking, p50 / without",
               percentile_ms(unseen, 50) / floor_ms, at_most=RATIO),
    ]  # fmt: skip
    if not seen:
        print("  no chromium here: with a viewer it was NOT measured")
        return figures
    return [
        *figures,
        Figure("with both, a browser here looking, p50 / without",
               percentile_ms(seen, 50) / floor_ms, at_most=RATIO),
        Figure("the page is drawn", float(np.median(rates)), "Hz"),
        Figure("CPU of the console with one viewer", float(np.median(shares)), "cores",
               at_most=CPU_SHARE),
    ]  # fmt: skip


def _delays(bus: Bus, commands: list[Received[Command]], span_s: float) -> list[int]:
    """Return how long after its sample each command came, ns."""
    end_s = time.monotonic() + _SETTLED_S
    while time.monotonic() < end_s:
        bus.pump(0.1)
    commands.clear()
    end_s = time.monotonic() + span_s
    while time.monotonic() < end_s:
        bus.pump(0.1)
    return [r.received_ns - r.envelope.origin.captured_ns for r in commands if r.envelope.origin]


@contextlib.contextmanager
def _page_and_recorder(
    stack: Stack, folder: Path, model: Path, turn: int
) -> Iterator[tuple[StackProcess, str]]:
    """Have both for a while; yield the console and its page's address."""
    models = ("--models", json.dumps([str(model)]))
    console = stack.start("console", f"page-{turn}", "--port", 0, *models)
    recorder = stack.start(
        "recorder", f"rec-{turn}", "--folder", folder / f"takes-{turn}", *models, "--free-mb", 0
    )
    both = {Member(process.service, process.instance) for process in (console, recorder)}
    stack.until(lambda: both <= stack.present, SLOW_S)
    bus = stack.open_bus("observer", f"o-{turn}")
    key = bus.keys.rpc("console", console.instance, "describe")
    (answer,) = bus.ask(key, Ask(), Description, timeout_s=5.0)
    yield console, answer.body.facts["page"]
    console.stop()
    recorder.stop()


@contextlib.contextmanager
def _viewer(url: str, profile: Path) -> Iterator[bool]:
    """Look at the page; yield whether there is a browser to look with."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        yield False
        return
    size = ("--window-size=800,600", "--force-device-scale-factor=0.5")
    debugging = ("--remote-debugging-port=0", f"--user-data-dir={profile}")
    browser = subprocess.Popen(
        ["nice", "-n", "10", program, *FLAGS, *size, *debugging, url],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield True
    finally:
        browser.terminate()
        browser.wait()


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(8.0)))
