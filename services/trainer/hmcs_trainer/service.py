"""The service: trains when asked, in a process of its own, and reports how far it is.

It also finds the parts of a recording by a model, in a process of its own as well.
"""

from __future__ import annotations

import logging
import time
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from hmcs.bus.messages import Ask, Done, ModelFile, ModelQuestion, Train, TrainingProgress
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received, RequestRefusedError
from hmcs.bus.verbs import CANCEL, MODEL_FILE, SEGMENT, TRAIN
from hmcs_trainer.asked import job_of
from hmcs_trainer.running import RunningJob
from hmcs_trainer.segmenting import Segmenting
from hmcs_trainer.settings import TrainerSettings

TOLD_EVERY_S = 0.1
AGAIN_EVERY_S = 2.0
"""The progress is published again after so long without news, for processes that joined later."""
FORGOTTEN_AFTER_S = 10.0
"""A trainer that has published no progress for so long counts as idle."""
MOST_ELSEWHERE = 64
"""The progress of so many other trainers is remembered at most."""
FETCHED_WITHIN_S = 5.0
_ENDED = ("done", "failed", "canceled")


class _Elsewhere(NamedTuple):
    model: str
    heard_s: float


class Trainer(Service):
    """Trains one model at a time and refuses a second request meanwhile."""

    name = "trainer"
    Settings = TrainerSettings
    settings: TrainerSettings

    def __init__(self, settings: TrainerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._running: RunningJob | None = None
        self._told_s = 0.0
        self._elsewhere: dict[str, _Elsewhere] = {}
        self._last = "nothing was trained yet"
        self._progress = bus.publisher(TrainingProgress, bus.keys.training)
        # A second one, to refuse who asks meanwhile.
        self._aside = ThreadPoolExecutor(2, thread_name_prefix="segmenting")
        self._segmenting = Segmenting(
            settings.folder, settings.sources, settings.segment_longest_s, self._model_file, log
        )

    def start(self) -> None:
        """Wait to be asked."""
        TRAIN.answer(self.bus, self._train)
        CANCEL.answer(self.bus, self._cancel)
        SEGMENT.answer(self.bus, self._segmenting.segmentation, aside=self._aside)
        self.bus.subscribe(TrainingProgress, self.bus.keys.training, self._on_progress)
        self.bus.watch(self.bus.keys.presence(self.name), self._on_trainer)
        self.bus.every(TOLD_EVERY_S, self._look)

    def health(self) -> tuple[bool, str]:
        """Say what is trained, or what came of the last training."""
        running = self._running
        return True, self._last if running is None else f"training {running.job.name}"

    def facts(self) -> dict[str, str]:
        """Say where models go, and where files may lie that a question names."""
        sources = ", ".join(str(source.resolve()) for source in self.settings.sources)
        return {"folder": str(self.settings.folder.resolve()), "sources": sources}

    def close(self) -> None:
        """End what is being trained or segmented; no half-written model stays."""
        self._segmenting.close()
        self._aside.shutdown(wait=False, cancel_futures=True)
        if self._running is not None:
            self._running.cancel(self.settings.stop_grace_s)

    def _train(self, asked: Train) -> Done:
        if self._running is not None:
            raise RequestRefusedError(
                f"{self._running.job.name} is being trained: wait until it is done, or cancel it"
            )
        job = job_of(asked, self.settings.folder.resolve(), self.settings.sources)
        for instance, elsewhere in self._elsewhere.items():
            if elsewhere.model == job.name and self._is_recent(elsewhere):
                raise RequestRefusedError(
                    f"{job.name} is being trained by trainer {instance}: wait until it is done, or "
                    "give this one another name"
                )
        try:
            job.model.parent.mkdir(parents=True, exist_ok=True)
            self._running = RunningJob(job, self.settings.longest_s, self.log)
        except OSError as error:
            self.log.warning("no training could begin", extra={"error": str(error)})
            raise RequestRefusedError(
                f"no training can begin here: {error.strerror}: see the trainer's log"
            ) from error
        self._tell("checking", "reading demonstrations", 0.0)
        self.log.info("training", extra={"model": job.name})
        return Done(detail=f"training {job.name} from {len(job.demonstrations)} files")

    def _cancel(self, _: Ask) -> Done:
        if self._running is None:
            raise RequestRefusedError("nothing is being trained")
        model = self._running.job.name
        self._running.cancel(self.settings.stop_grace_s)
        self._tell("canceled", "canceled; no model was written", self._running.share)
        self._end(f"{model}: canceled")
        return Done(detail=f"canceled {model}")

    def _model_file(self, name: str) -> ModelFile | None:
        question = ModelQuestion(model=name)
        answers = MODEL_FILE.ask(self.bus, question, timeout_s=FETCHED_WITHIN_S)
        return answers[0].body if answers else None

    def _on_progress(self, received: Received[TrainingProgress]) -> None:
        """Keep what other trainers are at."""
        instance, progress = received.envelope.source.instance, received.body
        self._elsewhere.pop(instance, None)
        if progress.stage in _ENDED or instance == self.bus.source.instance:
            return
        if len(self._elsewhere) >= MOST_ELSEWHERE:
            oldest = min(self._elsewhere, key=lambda name: self._elsewhere[name].heard_s)
            self._elsewhere.pop(oldest)
        self._elsewhere[instance] = _Elsewhere(progress.model, time.monotonic())

    def _on_trainer(self, key: str, alive: bool) -> None:
        if not alive:
            self._elsewhere.pop(self.bus.keys.member_of(key).instance, None)

    @staticmethod
    def _is_recent(elsewhere: _Elsewhere) -> bool:
        return time.monotonic() - elsewhere.heard_s < FORGOTTEN_AFTER_S

    def _look(self) -> None:
        running = self._running
        if running is None:
            return
        for detail in running.news():
            self._tell(running.stage, detail, running.share)
        code = running.ended()
        if code is None:
            if time.monotonic() - self._told_s > AGAIN_EVERY_S:
                self._tell(running.stage, running.detail, running.share)
            return
        job = running.job
        if code == 0:
            self._tell("done", running.detail, 1.0, str(job.model), str(job.report))
            self._end(f"{job.name}: {running.detail}")
        else:
            self._tell("failed", running.error(), running.share)
            self._end(f"{job.name} failed: {running.error()}")

    def _tell(
        self, stage: str, detail: str, share: float, path: str = "", report: str = ""
    ) -> None:
        assert self._running is not None
        self._told_s = time.monotonic()
        self._progress.put(
            TrainingProgress.model_validate(
                {
                    "model": self._running.job.name,
                    "stage": stage,
                    "detail": detail,
                    "share": share,
                    "path": path,
                    "report": report,
                }
            )
        )

    def _end(self, what: str) -> None:
        self._running, self._last = None, what
        self.log.info("training ended", extra={"what": what})
