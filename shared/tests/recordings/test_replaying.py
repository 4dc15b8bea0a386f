"""With which model a recording is replayed, and what is compared of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Belief, Step
from hmcs.bus.wire import encode
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.recognition.recognizer import Recognition, StepEvidence
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer, TaskFilter
from hmcs.recordings.comparing import compared
from hmcs.recordings.file_rotation import Preface, Recording
from hmcs.recordings.fixture_replay import replay_fixture
from hmcs.recordings.json_codec import fields_of
from hmcs.recordings.reading import RecordingError, read
from hmcs.recordings.replaying import kept_model, recognizer_named, replayed
from hmcs.translation import belief_message, evidence_message, step_of
from support.cells import Logged, performance, write_cell
from support.lessons import lesson_task, performed
from support.recordings import BEGUN_NS, ROOMY

Take = Callable[..., Path]


@pytest.fixture
def take(tmp_path: Path) -> Take:
    """A recording with models kept with it, and the one its fixture followed."""

    def write(*names: str, followed: str = "") -> Path:
        model, kept = learn(lesson_task(), [performed(1)]), {}
        for name in names:
            file = tmp_path / f"{name}.hmcs"
            save_model(model._replace(name=name), file)
            kept[file.name] = file.read_bytes()
        reported = {"active_model": followed, "settings": json.dumps({})}
        preface = Preface({"fixture_controller/f": reported}, kept)
        recording = Recording(tmp_path / "takes", "take", ROOMY, lambda: preface, BEGUN_NS, "test")
        recording.finish()
        return recording.path

    return write


@pytest.mark.parametrize(
    ("names", "followed", "chosen"),
    [(("one",), "", "one"), (("one", "two"), "two", "two"), (("one",), "gone", "one")],
)
def test_the_model_kept_alone_or_followed_is_replayed(
    take: Take, names: tuple[str, ...], followed: str, chosen: str
) -> None:
    assert kept_model(read(take(*names, followed=followed))).name == chosen


@pytest.mark.parametrize(("names", "says"), [((), "none"), (("one", "two"), "one.hmcs, two.hmcs")])
def test_where_nobody_knows_which_the_models_there_are_reported(
    take: Take, names: tuple[str, ...], says: str
) -> None:
    with pytest.raises(RecordingError, match=f"{says}; name one with --model"):
        kept_model(read(take(*names)))


@pytest.mark.parametrize(
    "name", ["../../up.hmcs", "/tmp/absolute.hmcs", "a/b.hmcs", ".hmcs", "\x1b.hmcs"]
)
def test_the_name_of_what_is_kept_is_never_a_path(
    take: Take, tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = read(take("one")).attachments["one.hmcs"]
    paths = [kept_by(name, content, tmp_path / "evil") for content in (good, b"no model")]
    before = set(tmp_path.rglob("*"))
    written = files_written(monkeypatch)
    assert kept_model(read(paths[0])).name == "one"
    with pytest.raises(RecordingError, match=r"mcap: the model .* that is kept with it: no model"):
        kept_model(read(paths[1]))
    assert set(tmp_path.rglob("*")) == before
    assert [file.name for file in written] == ["kept.hmcs", "kept.hmcs"]
    assert not any(file.exists() for file in written)


def kept_by(name: str, content: bytes, folder: Path) -> Path:
    preface, take = Preface({}, {name: content}), f"take-{len(content)}"
    recording = Recording(folder, take, ROOMY, lambda: preface, BEGUN_NS, "test")
    recording.finish()
    return recording.path


def files_written(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Which files are written from now on."""
    written: list[Path] = []
    write = Path.write_bytes

    def noted(file: Path, data: bytes) -> int:
        written.append(file)
        return write(file, data)

    monkeypatch.setattr(Path, "write_bytes", noted)
    return written


# --- what is compared -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    file = tmp_path_factory.mktemp("models") / "lesson.hmcs"
    return save_model(learn(lesson_task(), [performed(seed) for seed in (1, 2)]), file)


@pytest.fixture(scope="module")
def said(model: Model) -> list[Logged]:
    return list(performance(model, performed(9, ("reach", "turn"))))


def lacking(
    said: list[Logged], model: Model, lost: Callable[[int], frozenset[int]]
) -> list[Logged]:
    """The same cell, whose task HMM did not get some evidence in time."""
    layered = SegmentFilterRecognizer(model, passed=lambda made: made.rounded("float32"))
    task = layered.task
    made: list[Logged] = []
    step = None

    class Deaf(TaskFilter):
        def step(self, evidence: StepEvidence) -> Recognition:
            missing = lost(evidence.step)
            kept = [k for k, g in enumerate(evidence.pair_gesteme) if g not in missing]
            return task.step(
                evidence._replace(
                    gestemes=tuple(g for g in evidence.gestemes if g not in missing),
                    pair_gesteme=evidence.pair_gesteme[kept],
                    pair_start=evidence.pair_start[kept],
                    exit=evidence.exit[kept],
                    log_ratio=evidence.log_ratio[kept],
                )
            )

    layered.task = Deaf(model)
    for each in said:
        if isinstance(each.body, Step):
            step = each
            recognition = layered.step(step_of(each.body))
            belief = belief_message(model, recognition, "clock")
        if isinstance(each.body, Belief):
            each = each._replace(body=belief)
        made.append(each)
        if isinstance(each.body, Belief) and step is not None:
            assert recognition.evidence is not None
            evidence = evidence_message(model, recognition.evidence, "clock", "float32")
            source = each.envelope.source.model_copy(update={"service": "gesteme_classifier"})
            envelope = each.envelope.model_copy(update={"source": source})
            made.append(each._replace(key="hmcs/e", body=evidence, envelope=envelope))
    return made


@pytest.mark.parametrize("every", [2, 5, 1000])
def test_steps_believed_without_all_evidence_are_counted_apart_and_all_others_are_the_same(
    said: list[Logged], model: Model, tmp_path: Path, every: int
) -> None:
    def lost(step: int) -> frozenset[int]:
        return frozenset({step % 3, (step // 2) % 3} if step % every == every - 1 else ())

    content = read(write_cell(tmp_path, lacking(said, model, lost)))
    comparison = compared(replayed(content, model))
    degraded = sum(bool(belief.missing_gestemes) for _, _, belief in content.of(Belief))
    assert comparison.degraded == degraded == comparison.steps // every
    assert comparison.compared == comparison.steps - degraded
    assert comparison.same_bits == comparison.compared
    assert comparison.agreement == 1.0


def test_another_model_has_all_evidence(said: list[Logged], model: Model, tmp_path: Path) -> None:
    content = read(write_cell(tmp_path, lacking(said, model, lambda step: frozenset({step % 3}))))
    other = save_model(learn(lesson_task(), [performed(3)])._replace(name="o"), tmp_path / "o.hmcs")
    replay = replayed(content, other)
    assert not any(believed.replayed.missing_gestemes for believed in replay.beliefs)
    assert compared(replay).degraded == len(replay.beliefs)


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("hmcs/@v1/demo/model/mine/belief", "mine"),
        ("hmcs/@v1/demo/model/mine/belief/a1b2", "mine"),
        ("hmcs/@v1/demo/model/model/belief/belief", "model"),
        ("hmcs/@v1/demo/model/belief", ""),
        ("unknown/3", ""),
    ],
)
def test_a_belief_is_of_the_recognizer_its_key_names(key: str, name: str) -> None:
    assert recognizer_named(key) == name


def test_beliefs_of_several_processes_of_one_model_are_compared_once_and_the_complete_one(
    said: list[Logged], model: Model, tmp_path: Path
) -> None:
    poor = lacking(said, model, lambda step: frozenset({0}))
    rich = lacking(said, model, lambda _: frozenset())
    key = f"hmcs/@v1/test/model/{model.name}/belief"
    both = [
        again
        for bad, good in zip(poor, rich, strict=True)
        for again in (
            [bad._replace(key=f"{key}/a"), good._replace(key=f"{key}/b")]
            if bad.is_of(Belief)
            else [good]
        )
    ]
    content = read(write_cell(tmp_path, both))
    replay = replayed(content, model)
    comparison = compared(replay)
    assert (replay.compared_with, comparison.degraded) == (model.name, 0)
    assert comparison.same_bits == comparison.steps
    alone = read(write_cell(tmp_path / "alone", rich))
    expected = replay_fixture(alone, replayed(alone, model))
    factors = [tick.now.factor for tick in replay_fixture(content, replay).ticks]
    assert factors == [tick.now.factor for tick in expected.ticks]


def test_steps_that_stand_there_twice_are_taken_once(
    said: list[Logged], model: Model, tmp_path: Path
) -> None:
    """Among the steps made before, and as they came."""
    steps = [each for each in said if each.is_of(Step)]
    twice = [
        each
        for at, each in enumerate(said)
        for each in ([each, *steps[2:5]] if at == 200 else [each])
    ]
    replay = replayed(read(write_cell(tmp_path, twice)), model)
    assert [believed.step for believed in replay.beliefs] == list(range(len(steps)))
    assert replay.notes == ()
    assert compared(replay).same_bits == len(steps)


@pytest.mark.parametrize(
    "facts",
    [
        {"settings": "{", "active_model": "x"},
        {"settings": "[1]"},
        {"settings": "[" * 100_000},
        {"settings": '{"precision": "float16", "belief_stale_after_ms": "soon"}'},
        {"settings": '{"precision": null, "unknown_limit": 1e999, "belief_stale_after_ms": -5}'},
        {"settings": ""},
        {},
    ],
)
def test_settings_that_cannot_be_read_are_as_if_none_were_kept(
    said: list[Logged], model: Model, tmp_path: Path, facts: dict[str, str]
) -> None:
    rich = lacking(said, model, lambda _: frozenset())
    metadata = {"gesteme_classifier/a": facts, "fixture_controller/f": facts}
    recording = Recording(tmp_path, "take", ROOMY, lambda: Preface(metadata, {}), BEGUN_NS, "test")
    for each in rich:
        recording.write(each.key, fields_of(encode(each.body, each.envelope)), each.log_ns, None)
    recording.finish()
    content = read(recording.path)
    replay = replayed(content, model)
    assert compared(replay).same_bits == len(replay.beliefs)
    assert len(replay_fixture(content, replay).ticks) > 0


def test_beliefs_without_a_probability_for_each_state_are_compared_with_nothing(
    said: list[Logged], model: Model, tmp_path: Path
) -> None:
    empty = {"states": (), "probabilities": np.zeros(0)}
    bad = [
        each._replace(body=each.body.model_copy(update=empty)) if each.is_of(Belief) else each
        for each in said
    ]
    content = read(write_cell(tmp_path, bad))
    comparison = compared(replayed(content, model))
    assert (comparison.compared, comparison.degraded) == (0, 0)
