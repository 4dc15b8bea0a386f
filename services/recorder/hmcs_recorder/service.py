"""The service: everything that is published in the cell, into a file, and never in anybody's way.

Where the disk is full, or the folder gone, the recording ends, which health and log report;
what comes from then on is counted as lost, and recording goes on in a new file as soon as it can.
Recordings are read, to set labels by, on a thread of its own meanwhile.
"""

from __future__ import annotations

import importlib.metadata
import logging
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

from hmcs.bus.counters import Sequences
from hmcs.bus.keys import check_name
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import (
    ChangeRecording,
    Done,
    Envelope,
    LastStepsQuestion,
    Outline,
    OutlineQuestion,
    Record,
    SetLabels,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.verbs import CHANGE_RECORDING, LAST_STEPS, OUTLINE, RECORD, SET_LABELS
from hmcs.bus.wire import encode
from hmcs.errors import UserError
from hmcs.recordings.file_rotation import Limits, Preface, Recording
from hmcs.recordings.foxglove_layout import LAYOUT_NAME, foxglove_layout
from hmcs.recordings.json_codec import Fields, fields_of
from hmcs.recordings.label_files import has_fingerprint
from hmcs.recordings.labels import labels_beside
from hmcs_recorder.changing import changed
from hmcs_recorder.labeling import labels_set, outline_of
from hmcs_recorder.prefacing import ask_all, joined, preface_of
from hmcs_recorder.robots import Robots
from hmcs_recorder.settings import RecorderSettings
from hmcs_recorder.wall_clock import WallClock

LOST = "recording"
"""What is counted as lost while nothing can be written."""
MOST_PAST_STEPS = 10_000
RETRY_S = 5.0
"""After so long without room it is tried again."""
LARGEST_CLOCK_DIFFERENCE_NS = 5_000_000_000
"""A capture that seems longer ago has the time of another machine's clock."""


class Recorder(Service):
    """Writes down whatever is published."""

    name = "recorder"
    Settings = RecorderSettings
    settings: RecorderSettings

    def __init__(self, settings: RecorderSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._limited = RateLimitedLog(log)
        self._recording: Recording | None = None
        self._wanted = ""
        self._trouble = ""
        self._again_s = 0.0
        self._sequences = Sequences()
        self._clock = WallClock(lambda: time.time_ns(), lambda: time.monotonic_ns())
        self._earliest_ns = 0
        """No message of this file is logged before: times within a file never fall."""
        self._robots = Robots(bus, log)
        self._reading = ThreadPoolExecutor(1, thread_name_prefix="reading")

    def start(self) -> None:
        """Listen, and record unless the settings say to wait."""
        RECORD.answer(self.bus, self._asked)
        OUTLINE.answer(self.bus, self._outline, aside=self._reading)
        SET_LABELS.answer(self.bus, self._set_labels, aside=self._reading)
        CHANGE_RECORDING.answer(self.bus, self._change, aside=self._reading)
        self.bus.listen(self.bus.keys.everything, self._on_arrival)
        if self.settings.autostart:
            self._begin("")
        self.bus.every(self.settings.flush_s, self._on_flush)

    def health(self) -> tuple[bool, str]:
        """Say where it records, or why it does not."""
        if self._trouble:
            lost = self.bus.counters.lost[LOST]
            return False, f"not recording, {lost} messages lost: {self._trouble}"
        if self._recording is None:
            return True, "waiting for a request to record"
        return True, f"recording to {self._recording.path}, {self._recording.messages} messages"

    def facts(self) -> dict[str, str]:
        """Name the file and how much is in it."""
        recording = self._recording
        return {
            "recording": "" if recording is None else str(recording.path),
            "messages": str(0 if recording is None else recording.messages),
            "folder": str(self.settings.folder),
        }

    def close(self) -> None:
        """End the recording."""
        self._end()
        self._reading.shutdown(cancel_futures=True)

    def _outline(self, asked: OutlineQuestion) -> Outline:
        return outline_of(self.settings, asked)

    def _set_labels(self, asked: SetLabels) -> Done:
        return labels_set(self.settings, asked)

    def _change(self, asked: ChangeRecording) -> Done:
        recording = self._recording
        return changed(self.settings, asked, None if recording is None else recording.path)

    def _asked(self, asked: Record) -> Done:
        if not asked.on:
            if self._recording is None and not self._wanted:
                raise RequestRefusedError("nothing is being recorded")
            path = "" if self._recording is None else str(self._recording.path)
            self._end()
            return Done(detail=f"ended {path}".strip())
        if self._recording is not None:
            raise RequestRefusedError(
                f"{self._recording.path} is being recorded already: end it first"
            )
        if asked.name:
            check_name("recording", asked.name)
        begun = self._begin(asked.name)
        if begun is None:
            # Who was refused does not expect it to begin later by itself.
            self._wanted, reason, self._trouble = "", self._trouble, ""
            raise RequestRefusedError(reason)
        return Done(detail=f"recording to {begun.path}{_of_labels_there(begun.path)}")

    # --- writing ----------------------------------------------------------------------------------

    def _on_arrival(self, arrival: Arrival) -> None:
        if not self._wanted:
            return
        if self._recording is None:
            self.bus.counters.lost[LOST] += 1
            return
        try:
            fields = fields_of(arrival.payload)
            self._mind_clock(self._recording)
            self._write(self._recording, arrival, fields)
        except OSError as error:
            self.bus.counters.lost[LOST] += 1
            self._interrupted(error)
            return
        except Exception as error:
            # Whatever it is about one message, those that came with it are recorded.
            expected = isinstance(error, ValueError)
            self.bus.counters.count_refused(LOST, str(error))
            self._limited.warning(
                "not recorded",
                "not recorded",
                exc_info=not expected,
                key=arrival.key,
                reason=str(error) or type(error).__name__,
            )
            return
        self._count(arrival.key, fields)

    def _write(self, recording: Recording, arrival: Arrival, fields: Fields) -> None:
        log_ns = max(self._clock.of(arrival.received_ns), self._earliest_ns)
        before = recording.path
        recording.write(arrival.key, fields, log_ns, self._captured_ns(fields, log_ns))
        self._earliest_ns = log_ns
        if recording.path != before:
            self.log.info("recording goes on", extra={"file": str(recording.path)})

    def _mind_clock(self, recording: Recording) -> None:
        """Go on in a new file where the clock was set, or the machine slept.

        Within a file times never fall, and each file's times are those that people know.
        """
        by_ns = self._clock.set_by_ns()
        if not by_ns:
            return
        self._clock.reckon_anew()
        self._earliest_ns = self._clock.now_ns()
        recording.next_part(self._earliest_ns)
        self.log.warning(
            "the system's clock was set, or the machine slept: recording goes on in a new file",
            extra={"by_s": by_ns / 1e9, "file": str(recording.path)},
        )

    def _count(self, key: str, fields: Fields) -> None:
        lost = self._sequences.note(key, fields["source"]["boot"], fields["seq"])
        schema = fields["schema"].partition("/")[0]
        self.bus.counters.received[schema] += 1
        if lost:
            self.bus.counters.lost[schema] += lost
            self._limited.warning(f"lost {key}", "messages lost", key=key, lost=lost)

    def _captured_ns(self, fields: Fields, log_ns: int) -> int | None:
        origin = fields.get("origin")
        if origin is None:
            return None
        captured_ns = self._clock.of(origin["captured_ns"])
        known = 0 <= log_ns - captured_ns <= LARGEST_CLOCK_DIFFERENCE_NS
        return captured_ns if known else None

    def _on_flush(self) -> None:
        if self._recording is not None:
            try:
                self._mind_clock(self._recording)
                self._robots.name_joints(self._recording, self._earliest_ns)
                self._recording.flush()
            except OSError as error:
                self._interrupted(error)
        elif self._wanted and time.monotonic() >= self._again_s:
            self._open(f"{self._wanted}-{_now():%H%M%S%f}", next_free=True)

    def _interrupted(self, error: OSError) -> None:
        if self._recording is not None:
            self._recording.abandon()
            self._recording = None
        if not self._trouble:
            self.log.error("recording is interrupted", extra={"reason": str(error)})
        self._trouble = str(error)
        self._again_s = time.monotonic() + RETRY_S

    def _begin(self, name: str) -> Recording | None:
        """Begin a recording, named by date and time where it has no name; else as `_open`."""
        self._wanted = name or f"{_now():%Y%m%d-%H%M%S}"
        try:
            return self._open(self._wanted, next_free=not name)
        except UserError:
            self._wanted = ""
            raise

    def _open(self, name: str, *, next_free: bool) -> Recording | None:
        """Begin a file; None where that cannot be, which health reports.

        Raises UserError where the name is taken, unless the next one that is free will do.
        """
        settings = self.settings
        limits = Limits(settings.part_mb, settings.part_s, settings.limit_mb, settings.free_mb)
        library = f"hmcs {importlib.metadata.version('hmcs')}"
        self._clock.reckon_anew()
        begun_ns = self._earliest_ns = self._clock.now_ns()
        try:
            recording = Recording(
                settings.folder, name, limits, self._preface, begun_ns, library, next_free=next_free
            )
        except OSError as error:
            self._interrupted(error)
            return None
        self._recording, self._trouble = recording, ""
        try:
            self._write_past_steps(recording, begun_ns)
        except OSError as error:
            self._interrupted(error)
            return None
        self.log.info("recording", extra={"file": str(recording.path)})
        return recording

    def _write_past_steps(self, recording: Recording, begun_ns: int) -> None:
        """Begin with the steps made before: recognizers know them, and so must a replay."""
        bus = self.bus
        question = LastStepsQuestion(count=MOST_PAST_STEPS)
        for answer in ask_all(bus, LAST_STEPS, question)[:1]:
            for step, origin in zip(answer.body.steps, answer.body.origins, strict=False):
                # A device numbers its steps as it numbers their messages.
                envelope = Envelope(source=answer.envelope.source, seq=step.index, origin=origin)
                fields = fields_of(encode(step, envelope))
                captured_ns = self._captured_ns(fields, begun_ns)
                recording.write(bus.keys.step, fields, begun_ns, captured_ns)

    def _end(self) -> None:
        recording, self._recording, self._wanted, self._trouble = self._recording, None, "", ""
        if recording is None:
            return
        try:
            recording.finish()
        except OSError as error:
            recording.abandon()
            self.log.warning("the recording has no index", extra={"reason": str(error)})
        else:
            self.log.info("recorded", extra={"file": str(recording.path)})

    # --- what is kept with it ---------------------------------------------------------------------

    def _preface(self) -> Preface:
        self._robots.ask()
        layout = Preface({}, {LAYOUT_NAME: foxglove_layout()})
        about = preface_of(self.bus, self.settings.models, self.log)
        return joined(about, layout, *self._robots.kept())


def _of_labels_there(recording: Path) -> str:
    """What to tell of labels beside a recording that only begins."""
    beside = labels_beside(recording)
    if not beside.exists():
        return ""
    if has_fingerprint(beside):
        return f"; the labels in {beside.name} are of an earlier one and do not count for it"
    return (
        f"; the labels in {beside.name} do not say of which recording they are and will count for "
        "it: move that file away if they are of an earlier one"
    )


def _now() -> datetime:
    return datetime.now(UTC)
