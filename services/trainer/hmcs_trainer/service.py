"""The service: trains when asked, in a process of its own, and tells how far it is."""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import threading
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO

from hmcs.bus.keys import check_name
from hmcs.bus.messages import Ask, Done, Train, TrainingProgress
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.recognition.recognizers import DEFAULT
from hmcs_trainer.settings import TrainerSettings

TOLD_EVERY_S = 0.1
_JUDGING = "judging"
_ENDED = ("done", "failed", "canceled")
_LEARNED_SHARE = 0.5
"""Of the whole, where learning has ended and judging begins."""


class Trainer(Service):
    """Trains one model at a time."""

    name = "trainer"
    Settings = TrainerSettings
    settings: TrainerSettings

    def __init__(self, settings: TrainerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._job: _Job | None = None
        self._elsewhere: dict[str, str] = {}
        self._last = "nothing was trained yet"
        self._progress = bus.publisher(TrainingProgress, bus.keys.training)

    def start(self) -> None:
        """Wait to be asked."""
        self.bus.answer("train", Train, self._train)
        self.bus.answer("cancel", Ask, self._cancel)
        self.bus.subscribe(TrainingProgress, self.bus.keys.training, self._on_progress)
        self.bus.watch(self.bus.keys.presence(self.name), self._on_trainer)
        self.bus.every(TOLD_EVERY_S, self._look)

    def health(self) -> tuple[bool, str]:
        """Say what is trained, or what came of the last training."""
        return True, self._last if self._job is None else f"training {self._job.model}"

    def facts(self) -> dict[str, str]:
        """Say where models go."""
        return {"folder": str(self.settings.folder.resolve())}

    def close(self) -> None:
        """End what is being trained; no half-written model stays."""
        if self._job is not None:
            self._job.cancel(self.settings.stop_grace_s)

    def _train(self, asked: Train) -> Done:
        if self._job is not None:
            raise RequestRefusedError(
                f"{self._job.model} is being trained: wait until it is done, or cancel it"
            )
        check_name("model", asked.model)
        for instance, model in self._elsewhere.items():
            if model == asked.model:
                raise RequestRefusedError(
                    f"{model} is being trained by trainer {instance}: wait until it is done, or "
                    "give this one another name"
                )
        self.settings.folder.mkdir(parents=True, exist_ok=True)
        self._job = _Job(asked, self.settings.folder.resolve())
        self._tell("checking", "reading demonstrations", 0.0)
        self.log.info("training", extra={"model": asked.model})
        return Done(detail=f"training {asked.model} from {len(asked.demonstrations)} files")

    def _cancel(self, _: Ask) -> Done:
        if self._job is None:
            raise RequestRefusedError("nothing is being trained")
        model = self._job.model
        self._job.cancel(self.settings.stop_grace_s)
        self._tell("canceled", "canceled; no model was written", self._job.share)
        self._end(f"{model}: canceled")
        return Done(detail=f"canceled {model}")

    def _on_progress(self, received: Received[TrainingProgress]) -> None:
        """Keep what other trainers are at."""
        instance, told = received.envelope.source.instance, received.body
        if told.stage in _ENDED or instance == self.bus.source.instance:
            self._elsewhere.pop(instance, None)
        else:
            self._elsewhere[instance] = told.model

    def _on_trainer(self, key: str, alive: bool) -> None:
        if not alive:
            self._elsewhere.pop(self.bus.keys.member_of(key).instance, None)

    def _look(self) -> None:
        job = self._job
        if job is None:
            return
        for detail in job.news():
            self._tell(job.stage, detail, job.share)
        code = job.ended()
        if code is None:
            return
        if code == 0:
            self._tell("done", job.detail, 1.0, str(job.path), str(job.report))
            self._end(f"{job.model}: {job.detail}")
        else:
            self._tell("failed", job.error(), job.share)
            self._end(f"{job.model} failed: {job.error()}")

    def _tell(
        self, stage: str, detail: str, share: float, path: str = "", report: str = ""
    ) -> None:
        assert self._job is not None
        self._progress.put(
            TrainingProgress.model_validate(
                {
                    "model": self._job.model,
                    "stage": stage,
                    "detail": detail,
                    "share": share,
                    "path": path,
                    "report": report,
                }
            )
        )

    def _end(self, what: str) -> None:
        self._job, self._last = None, what
        self.log.info("training ended", extra={"what": what})


class _Job:
    """A process that trains, and what it says of it."""

    def __init__(self, asked: Train, folder: Path) -> None:
        self.model = asked.model
        self.path = folder / f"{asked.model}.hmcs"
        self.report = folder / f"{asked.model}.html"
        self.stage = "learning"
        self.detail = ""
        self.share = 0.0
        self._lines: SimpleQueue[str] = SimpleQueue()
        command = [sys.executable, "-m", "hmcs_trainer", asked.task, *asked.demonstrations]
        command += ["--output", str(self.path), "--name", asked.model, "--tell"]
        command += ["--recognizer", asked.recognizer or DEFAULT, "--report", str(self.report)]
        command += ["--find-states"] if asked.find_states else []
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._errors: list[str] = []
        self._readers = [
            threading.Thread(target=_read, args=(self._process.stdout, self._lines.put)),
            threading.Thread(target=_read, args=(self._process.stderr, self._errors.append)),
        ]
        for reader in self._readers:
            reader.start()

    def news(self) -> list[str]:
        """Return what was said since the last time."""
        said: list[str] = []
        while True:
            try:
                line = self._lines.get_nowait()
            except Empty:
                return said
            try:
                told = json.loads(line)
            except ValueError:
                continue
            if not isinstance(told, dict):
                continue
            if "detail" in told:
                self.detail = str(told["detail"])
                if self.detail == _JUDGING:
                    self.stage, self.share = _JUDGING, _LEARNED_SHARE
                said.append(self.detail)
            elif self.stage == _JUDGING and told.get("count"):
                done = float(told["done"]) / float(told["count"])
                self.share = _LEARNED_SHARE + (1.0 - _LEARNED_SHARE) * min(max(done, 0.0), 1.0)
                said.append(self.detail)

    def ended(self) -> int | None:
        """Return the exit code once everything it said was read; None before."""
        code = self._process.poll()
        if code is None or any(reader.is_alive() for reader in self._readers):
            return None
        self.news()
        return code

    def error(self) -> str:
        """Return what was wrong, in one line."""
        lines = [line for line in self._errors if line.strip()]
        last = lines[-1] if lines else f"the process ended with {self._process.returncode}"
        return last.removeprefix("hmcs_trainer: ")

    def cancel(self, grace_s: float) -> None:
        """End it."""
        self._process.terminate()
        try:
            self._process.wait(grace_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for reader in self._readers:
            reader.join()


def _read(stream: IO[str], take: object) -> None:
    assert callable(take)
    for line in stream:
        take(line.rstrip("\n"))
