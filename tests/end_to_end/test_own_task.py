"""A task of one's own from an empty folder: `hmcs new`, `hmcs up`, taught and assisted."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest

from hmcs.bus.messages import Belief, FixtureState, Train, TrainingProgress
from hmcs.bus.session import Bus
from hmcs.bus.verbs import TRAIN
from hmcs.recognition.model_file import load_model
from hmcs.recognizer_takeover import activate, load_into_fixture, load_into_recognizer
from hmcs_local.stack import LAYERED, LocalStack, with_free_port
from support.stack import CELL, clean_environment
from support.waiting import operator_at, wait_until

COMPOSE = Path(__file__).parents[2] / "compose.yaml"
DATA = COMPOSE.parent / "examples/data"
HANDS = [DATA / f"hand-{k}.csv" for k in (1, 2, 3, 4)]
STATES = {"reach", "turn", "lift"}


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[[Sequence[object]], None]]:
    """Starts programs in an empty folder, which end with the test; a stack ends its own."""
    processes: list[subprocess.Popen[bytes]] = []

    def start(words: Sequence[object]) -> None:
        log = (tmp_path / f"program-{len(processes)}.log").open("wb")
        with log:
            processes.append(
                subprocess.Popen(
                    [sys.executable, *map(str, words)],
                    cwd=tmp_path,
                    env=clean_environment() | {"HMCS_CELL": CELL},
                    stdout=log,
                    stderr=subprocess.STDOUT,
                )
            )

    yield start
    for process in reversed(processes):
        process.send_signal(signal.SIGTERM)
    for process in processes:
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@pytest.fixture
def joined() -> Iterator[Callable[[str], Bus]]:
    buses: list[Bus] = []

    def join(router: str) -> Bus:
        buses.append(wait_until(lambda: operator_at(router), "the router"))
        return buses[-1]

    yield join
    for bus in buses:
        bus.close()


def hmcs(folder: Path, *words: object) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "hmcs_local.command", *map(str, words)],
        cwd=folder,
        env=clean_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_demonstrations_are_learned_and_their_task_is_recognized_and_guided(
    tmp_path: Path, started: Callable[..., None], joined: Callable[[str], Bus]
) -> None:
    shutil.copy(DATA / "reach-and-lift.yaml", tmp_path / "mine.yaml")
    router = with_free_port("tcp/127.0.0.1:0")
    words = ("mine.yaml", *HANDS[:3], "--source", "recorded", "--router", router)
    started(("-m", "hmcs_local.command", "up", *words))
    bus = joined(router)
    beliefs: list[Belief] = []
    states: list[FixtureState] = []
    bus.subscribe(Belief, bus.keys.belief(), lambda received: beliefs.append(received.body))
    bus.subscribe(
        FixtureState, bus.keys.fixture_state, lambda received: states.append(received.body)
    )

    def guided() -> bool:
        bus.pump(0.05)
        return {state.state for state in states if state.engaged} >= STATES

    wait_until(guided, "guidance in all three states")
    assert all(set(belief.states) == STATES for belief in beliefs)


@pytest.fixture
def composed(tmp_path: Path) -> Iterator[Callable[[str], LocalStack]]:
    """Starts compose.yaml for `mine.yaml` as Compose does: its variables and mounts are all."""
    with ExitStack() as stacks:
        yield lambda router: stacks.enter_context(
            LocalStack(
                COMPOSE,
                variables={
                    "HMCS_TASK": "/tasks/mine.yaml",
                    "HMCS_TASK_FOLDER": str(tmp_path),
                    "HMCS_CELL": CELL,
                },
                environment={"console": {"HMCS_PORT": "0"}},
                router=router,
                folder=tmp_path / "out/up",
            )
        )


@pytest.mark.parametrize("by", ["hmcs up", "compose"])
def test_without_a_model_the_stack_waits_to_be_taught_and_follows_what_is_activated(
    tmp_path: Path,
    started: Callable[..., None],
    joined: Callable[[str], Bus],
    composed: Callable[[str], LocalStack],
    by: str,
) -> None:
    hmcs(tmp_path, "new", "mine", "--states", "reach,turn,lift")
    task = (tmp_path / "mine.yaml").read_text(encoding="utf-8")
    # The hands of the examples go farther than the box of a new task.
    task = task.replace("[0.75, 0.3, 0.7]", "[0.9, 0.4, 0.8]")
    task = task.replace("[0.6, 0.0, 0.45]", "[0.55, 0.0, 0.4]")
    (tmp_path / "mine.yaml").write_text(task, encoding="utf-8")
    router = with_free_port("tcp/127.0.0.1:0")
    stack = composed(router) if by == "compose" else None
    if stack is None:
        started(("-m", "hmcs_local.command", "up", "mine.yaml", "--router", router))
    bus = joined(router)
    progress: list[TrainingProgress] = []
    beliefs: list[Belief] = []
    states: list[FixtureState] = []
    bus.subscribe(
        TrainingProgress, bus.keys.training, lambda received: progress.append(received.body)
    )
    bus.subscribe(Belief, bus.keys.belief(), lambda received: beliefs.append(received.body))
    bus.subscribe(
        FixtureState, bus.keys.fixture_state, lambda received: states.append(received.body)
    )

    def present(*services: str) -> bool:
        bus.pump(0.05)
        return all(bus.present(bus.keys.presence(service)).members for service in services)

    everybody = ("robot", "trainer", "console", "recognizer", "fixture_controller", "recorder")
    wait_until(lambda: present(*everybody), "everybody")
    recordings = tmp_path / "out/up/recordings"
    recordings.mkdir(parents=True, exist_ok=True)
    for hand in HANDS[:3]:
        shutil.copy(hand, recordings)
    asked = Train(
        model="mine",
        task=str(tmp_path / "mine.yaml"),
        demonstrations=tuple(str(recordings / hand.name) for hand in HANDS[:3]),
    )
    (answer,) = TRAIN.ask(bus, asked, timeout_s=10.0)
    assert answer.body.detail

    def trained() -> TrainingProgress | None:
        bus.pump(0.05)
        ended = [each for each in progress if each.stage in ("done", "failed", "canceled")]
        return ended[-1] if ended else None

    done = wait_until(trained, "the training")
    assert done.stage == "done", done.detail
    # What the page does when *Activate what was trained* is pressed.
    for question in (
        load_into_fixture(done.path),
        load_into_recognizer(done.path),
        activate(done.model),
    ):
        (said,) = question.verb.ask(bus, question.body, service=question.service, timeout_s=20.0)
        assert said.body.detail
    words = ("--source", "recorded", "--demonstration", HANDS[3], "--repeat", 0, "--re-engage")
    started(
        ("-m", "hmcs_input_device", "--task", tmp_path / "mine.yaml", *words, "--router", router)
    )

    def guided() -> bool:
        bus.pump(0.05)
        return {state.state for state in states if state.engaged} >= STATES

    wait_until(guided, "guidance in all three states")
    assert beliefs
    if stack is None:
        return
    layered = [each for each in stack.processes.values() if each.service in LAYERED]
    assert [each.exit_code for each in layered] == [0, 0, 0]
    stack.stop_all()
    # A model under the name of the task is at work from the start the next time.
    stack.start_all()
    wait_until(lambda: present("gesteme_classifier", "task_hmm"), "the layered recognizer")


def test_a_second_host_has_its_models_from_the_one_that_has_them(
    tmp_path: Path, started: Callable[..., None], joined: Callable[[str], Bus]
) -> None:
    shutil.copy(DATA / "reach-and-lift.yaml", tmp_path / "mine.yaml")
    model = tmp_path / "robots-host" / "reach-and-lift.hmcs"
    model.parent.mkdir()
    hmcs(tmp_path, "train", "mine.yaml", *HANDS[:2], "--output", model, "--no-report")
    router = with_free_port("tcp/127.0.0.1:0")
    with_router = ("--router", router, "--folder", model.parent)
    here = "router,fixture-controller,robot"
    words = ("mine.yaml", "--model", model, "--services", here, *with_router)
    started(("-m", "hmcs_local.command", "up", *words))
    bus = joined(router)

    def present(*services: str) -> bool:
        bus.pump(0.05)
        return all(bus.present(bus.keys.presence(service)).members for service in services)

    wait_until(lambda: present("fixture_controller"), "the fixture controller")
    other = tmp_path / "other-host"
    compose = COMPOSE.read_text(encoding="utf-8")
    task = tmp_path / "mine.yaml"
    (tmp_path / "compose.yaml").write_text(
        compose.replace("HMCS_TASK:-human-shapes", f"HMCS_TASK:-{task}")
    )
    started(
        (
            *("-m", "hmcs_local.command", "up", "--compose", tmp_path / "compose.yaml"),
            *("--services", "gesteme-classifier,task-hmm", "--router", router, "--folder", other),
        )
    )
    wait_until(lambda: present("gesteme_classifier", "task_hmm"), "recognition on the other host")
    assert load_model(other / "models" / model.name).hash == load_model(model).hash
