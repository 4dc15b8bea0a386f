"""`hmcs replay --live`: an input device that plays a recording, and ends with it."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Motion
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, Received
from hmcs_local.stack import with_free_port
from support.recordings import Maker, hand_of

Eventually = Callable[[Callable[[], Any], float], Any]
HMCS = [sys.executable, "-m", "hmcs_local.command"]
WITHIN_S = 60.0


@pytest.fixture
def listener() -> Iterator[tuple[Bus, list[Received[Motion]]]]:
    """Somebody who hears the hand."""
    router = with_free_port("tcp/127.0.0.1:0")
    heard: list[Received[Motion]] = []
    settings = BusSettings(router=router, cell="demo")
    with open_router(router), Bus.open(settings, "listener", "x") as bus:
        bus.subscribe(Motion, bus.keys.motion, heard.append)
        yield bus, heard


@pytest.fixture
def live(
    tmp_path: Path, listener: tuple[Bus, list[Received[Motion]]]
) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Replay a recording of 2 s live, with words more."""
    take = Maker(tmp_path / "takes").write(list(hand_of(("lift", "carry"), 100)))
    started = []

    def start(*words: str) -> subprocess.Popen[bytes]:
        command = [*HMCS, "replay", str(take), "--live", "--router", listener[0].settings.router]
        with (tmp_path / "out").open("w") as out:
            process = subprocess.Popen([*command, *words], stdout=out, stderr=out)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()


def test_it_ends_with_its_recording_the_dead_man_released(
    live: Callable[..., subprocess.Popen[bytes]],
    listener: tuple[Bus, list[Received[Motion]]],
    eventually: Eventually,
    tmp_path: Path,
) -> None:
    bus, heard = listener
    process = live("--rate", "4")

    def ended() -> bool:
        bus.pump(0.01)
        return process.poll() is not None

    eventually(ended, WITHIN_S)
    assert (tmp_path / "out").read_text().count("played to the end") == 1
    assert process.returncode == 0
    bus.pump(0.5)
    held = [each.body.dead_man for each in heard]
    assert any(held)
    assert not held[-1]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_it_and_its_process_without_a_traceback(
    live: Callable[..., subprocess.Popen[bytes]],
    listener: tuple[Bus, list[Received[Motion]]],
    eventually: Eventually,
    is_gone: Callable[[int], bool],
    tmp_path: Path,
    number: int,
) -> None:
    bus, heard = listener
    process = live("--rate", "0.01")
    eventually(lambda: (bus.pump(0.01), heard)[1], WITHIN_S)
    (device,) = psutil.Process(process.pid).children()
    process.send_signal(number)
    assert process.wait(WITHIN_S) == 0
    assert "Traceback" not in (tmp_path / "out").read_text()
    assert is_gone(device.pid)


def test_an_unknown_task_is_refused_before_anything_is_started(tmp_path: Path) -> None:
    take = Maker(tmp_path / "takes").write(list(hand_of(("lift",), 50)))
    words = ["replay", str(take), "--live", "--task", "human-shape"]
    done = subprocess.run([*HMCS, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "did you mean human-shapes?" in done.stderr
    assert done.stderr.count("\n") == 1
