"""The stages of both loops as processes on raw sockets: the same work, and no bus.

`python -m bench.stages STAGE …` is one of them. It prints the port it listens on, if it does, and
ends when its predecessors have. A stage does what the service of its name does with a message and
no more: no counters, no sequence numbers, no timers, no questions.
"""

from __future__ import annotations

import argparse
import socket
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue

import numpy as np

from bench.sockets import Frame, accept, connect, frames, listen, send
from hmcs.bus.examples import ENVELOPE
from hmcs.bus.messages import Belief, Envelope, Evidence, Motion, Step
from hmcs.bus.wire import decode, encode
from hmcs.fixtures.controller.controller import Controller, Safeguards
from hmcs.motion.demonstrations import read_csv
from hmcs.recognition.model_file import load_model
from hmcs.recognition.segment_filter.recognizer import TaskFilter, bank_of
from hmcs.translation import sample_of, step_of
from hmcs_fixture_controller.translation import command_of, state_of
from hmcs_input_device.playback import Passes, Playback
from hmcs_task_hmm.gathering import Gathering
from hmcs_task_hmm.reading import read_evidence

LONG_NS = 10**12


def pipe(to: int) -> None:
    """Hand on bytes: the two hops with nothing in between."""
    server, port = listen()
    print(port, flush=True)
    with connect(to) as following, accept(server) as before:
        for frame in frames(before):
            send(following, frame)


def operator(to: int, path: Path, rate_hz: float, count: int) -> None:
    """Sample a playback at a rate and send each sample as a Motion."""
    playback = Playback(read_csv(path), Passes(rate_hz, repeat=0, lead_in_s=0.0))
    with connect(to) as following:
        began_s = time.monotonic()
        for k in range(count):
            time.sleep(max(0.0, began_s + k / rate_hz - time.monotonic()))
            now_ns = time.monotonic_ns()
            motion = Motion(**playback.sample(k / rate_hz)._asdict())
            send(following, Frame(now_ns, encode(motion, ENVELOPE)))


def fixture(to: int) -> None:
    """Make a Command of each Motion; then the FixtureState, which nobody waits for."""
    server, port = listen()
    print(port, flush=True)
    controller = Controller(Safeguards())
    with connect(to) as following, accept(server) as before:
        for number, frame in enumerate(frames(before)):
            _, motion = decode(frame.payload, Motion)
            made = controller.on_sample(time.monotonic(), sample_of(motion, number, None))
            command = command_of(made, 100.0)
            send(following, Frame(frame.caused_ns, encode(command, ENVELOPE)))
            encode(state_of(made), ENVELOPE)


def classifier(to: int, path: Path) -> None:
    """Make Evidence of each Step, for all gestemes of a model."""
    model = load_model(path)
    bank = bank_of(model)
    server, port = listen()
    print(port, flush=True)
    with connect(to) as following, accept(server) as before:
        for frame in frames(before):
            _, step = decode(frame.payload, Step)
            evidence = bank.step(step_of(step))
            message = Evidence(
                model_hash=model.hash,
                clock="clock",
                step=evidence.step,
                gestemes=tuple(model.gesteme_names[g] for g in evidence.gestemes),
                pair_gesteme=evidence.pair_gesteme,
                pair_start=evidence.pair_start,
                exit=evidence.exit.astype(np.float32),
                log_ratio=evidence.log_ratio.astype(np.float32),
            )
            send(following, Frame(frame.caused_ns, encode(message, ENVELOPE)))


def task(to: int, path: Path, inputs: int) -> None:
    """Make a Belief of each step's Evidence as soon as every gesteme is covered."""
    model = load_model(path)
    recognizer = TaskFilter(model)
    gathering = Gathering(recognizer.gestemes, LONG_NS)
    arrived: SimpleQueue[Frame] = SimpleQueue()
    server, port = listen()
    print(port, flush=True)
    with connect(to) as following, ExitStack() as open_ones:
        for _ in range(inputs):
            before = open_ones.enter_context(accept(server))
            threading.Thread(target=_take, args=(before, arrived), daemon=True).start()
        while True:
            frame = arrived.get()
            if not frame.payload:
                return
            schema, envelope = _schema_of(frame)
            if schema == Step.SCHEMA:
                step = decode(frame.payload, Step)[1].index
                gathering.begin(step, time.monotonic_ns())
            else:
                evidence = read_evidence(decode(frame.payload, Evidence)[1], model)
                gathering.add(evidence, time.monotonic_ns())
            while (released := gathering.release(time.monotonic_ns())) is not None:
                made = recognizer.step(released)
                belief = Belief(
                    model_hash=model.hash,
                    clock="clock",
                    step=made.belief.step,
                    states=model.state_names,
                    probabilities=made.belief.states,
                    unknown=made.belief.unknown,
                    likely_gesteme=model.gesteme_names[made.belief.gesteme],
                    segment_start=made.belief.segment_start,
                    log_likelihood=made.belief.log_likelihood,
                    mean_log_likelihood=made.mean_log_likelihood,
                    unknown_alarm=made.unknown_alarm,
                    missing_gestemes=(),
                )
                send(following, Frame(frame.caused_ns, encode(belief, envelope)))


def _schema_of(frame: Frame) -> tuple[str, Envelope]:
    is_step = b"displacement" in frame.payload
    return (Step.SCHEMA if is_step else Evidence.SCHEMA), ENVELOPE


def _take(connection: socket.socket, arrived: SimpleQueue[Frame]) -> None:
    for frame in frames(connection):
        arrived.put(frame)
    arrived.put(Frame(0, b""))


def main() -> None:
    """Be the stage that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m bench.stages", description=__doc__)
    parser.add_argument("stage", choices=("pipe", "operator", "fixture", "classifier", "task"))
    parser.add_argument("--to", type=int, required=True, help="port of the next stage")
    parser.add_argument("--file", type=Path, help="model, or demonstration")
    parser.add_argument("--rate-hz", type=float, default=100.0)
    parser.add_argument("--count", type=int, default=0, help="samples an operator makes")
    parser.add_argument("--inputs", type=int, default=1, help="connections a task waits for")
    given = parser.parse_args()
    if given.stage == "pipe":
        pipe(given.to)
    elif given.stage == "operator":
        operator(given.to, given.file, given.rate_hz, given.count)
    elif given.stage == "fixture":
        fixture(given.to)
    elif given.stage == "classifier":
        classifier(given.to, given.file)
    else:
        task(given.to, given.file, given.inputs)


if __name__ == "__main__":
    main()
