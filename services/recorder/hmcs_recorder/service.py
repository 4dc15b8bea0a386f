"""The service: everything that is published in the cell, into a file, and never in anybody's way.

Where the disk is full the recording ends, which is told in health and log; what comes from then on
is counted as lost, and recording goes on in a new file as soon as there is room. Recordings are
read, to set labels by, on a thread of its own meanwhile.
"""

from __future__ import annotations

import importlib.metadata
import json
import logging
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

from hmcs.bus.counters import Sequences
from hmcs.bus.keys import ANY, check_name
from hmcs.bus.logs import Seldom
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import (
    Ask,
    Description,
    Done,
    Envelope,
    LastSteps,
    LastStepsQuestion,
    Outline,
    OutlineQuestion,
    Record,
    SetLabels,
    SettingsReport,
)
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.wire import encode
from hmcs.recordings.parts import Limits, Preface, Recording, as_fields
from hmcs.recordings.plain import Fields, fields_of
from hmcs_recorder.labeling import labels_set, outline_of
from hmcs_recorder.settings import RecorderSettings

LOST = "recording"
"""What is counted as lost while nothing can be written."""
MOST_PAST_STEPS = 10_000
RETRY_S = 5.0
"""After so long without room it is tried again."""
LARGEST_CLOCK_DIFFERENCE_NS = 5_000_000_000
"""A capture that seems longer ago was told by another machine's clock."""
ASK_S = 0.5


class Recorder(Service):
    """Writes down whatever is published."""

    name = "recorder"
    Settings = RecorderSettings
    settings: RecorderSettings

    def __init__(self, settings: RecorderSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._seldom = Seldom(log)
        self._recording: Recording | None = None
        self._wanted = ""
        self._trouble = ""
        self._again_s = 0.0
        self._sequences = Sequences()
        self._wall_minus_monotonic_ns = time.time_ns() - time.monotonic_ns()
        self._reading = ThreadPoolExecutor(1, thread_name_prefix="reading")

    def start(self) -> None:
        """Listen, and record unless told to wait."""
        self.bus.answer("record", Record, self._asked)
        self.bus.answer("outline", OutlineQuestion, self._outline, aside=self._reading)
        self.bus.answer("set_labels", SetLabels, self._set_labels, aside=self._reading)
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
            return True, "waiting to be told to record"
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
            raise RequestRefusedError(self._trouble)
        return Done(detail=f"recording to {begun.path}")

    # --- writing ----------------------------------------------------------------------------------

    def _on_arrival(self, arrival: Arrival) -> None:
        if not self._wanted:
            return
        if self._recording is None:
            self.bus.counters.lost[LOST] += 1
            return
        log_ns = arrival.received_ns + self._wall_minus_monotonic_ns
        try:
            fields = fields_of(arrival.payload)
            captured_ns = self._captured_ns(fields, log_ns)
            self._recording.write(arrival.key, fields, log_ns, captured_ns)
        except ValueError as error:
            self.bus.counters.count_refused(LOST, str(error))
            self._seldom.warning(arrival.key, "not recorded", key=arrival.key, reason=str(error))
            return
        except OSError as error:
            self.bus.counters.lost[LOST] += 1
            self._interrupted(error)
            return
        self._count(arrival.key, fields)

    def _count(self, key: str, fields: Fields) -> None:
        lost = self._sequences.note(key, fields["source"]["boot"], fields["seq"])
        schema = fields["schema"].partition("/")[0]
        self.bus.counters.received[schema] += 1
        if lost:
            self.bus.counters.lost[schema] += lost
            self._seldom.warning(f"lost {key}", "messages lost", key=key, lost=lost)

    def _captured_ns(self, fields: Fields, log_ns: int) -> int | None:
        origin = fields.get("origin")
        if not isinstance(origin, dict) or not isinstance(origin.get("captured_ns"), int):
            return None
        captured_ns = origin["captured_ns"] + self._wall_minus_monotonic_ns
        known = 0 <= log_ns - captured_ns <= LARGEST_CLOCK_DIFFERENCE_NS
        return captured_ns if known else None

    def _on_flush(self) -> None:
        if self._recording is not None:
            try:
                self._recording.flush()
            except OSError as error:
                self._interrupted(error)
        elif self._wanted and time.monotonic() >= self._again_s:
            self._open(f"{self._wanted}-{_now():%H%M%S%f}")

    def _interrupted(self, error: OSError) -> None:
        if self._recording is not None:
            self._recording.abandon()
            self._recording = None
        if not self._trouble:
            self.log.error("recording is interrupted", extra={"reason": str(error)})
        self._trouble = str(error)
        self._again_s = time.monotonic() + RETRY_S

    def _begin(self, name: str) -> Recording | None:
        self._wanted = name or f"{_now():%Y%m%d-%H%M%S}"
        return self._open(self._wanted)

    def _open(self, name: str) -> Recording | None:
        settings = self.settings
        limits = Limits(settings.part_mb, settings.part_s, settings.limit_mb, settings.free_mb)
        library = f"hmcs {importlib.metadata.version('hmcs')}"
        try:
            self._recording = Recording(
                settings.folder, name, limits, self._preface, time.time_ns(), library
            )
        except OSError as error:
            self._interrupted(error)
            return None
        self._trouble = ""
        self.log.info("recording", extra={"file": str(self._recording.path)})
        self._write_past_steps(self._recording)
        return self._recording

    def _write_past_steps(self, recording: Recording) -> None:
        """Begin with the steps made before: recognizers know them, and so must a replay."""
        bus = self.bus
        key = bus.keys.rpc("input_device", ANY, "last_steps")
        question = LastStepsQuestion(count=MOST_PAST_STEPS)
        for answer in bus.ask(key, question, LastSteps, ASK_S)[:1]:
            now_ns = time.monotonic_ns() + self._wall_minus_monotonic_ns
            for step, origin in zip(answer.body.steps, answer.body.origins, strict=False):
                # A device numbers its steps as it numbers their messages.
                envelope = Envelope(source=answer.envelope.source, seq=step.index, origin=origin)
                fields = fields_of(encode(step, envelope))
                captured_ns = self._captured_ns(fields, now_ns)
                recording.write(bus.keys.step, fields, now_ns, captured_ns)

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
        """Who is there, what they are told to do, and the models they work with."""
        bus = self.bus
        described = bus.ask(bus.keys.rpc(ANY, ANY, "describe"), Ask(), Description, ASK_S)
        settings = bus.ask(bus.keys.rpc(ANY, ANY, "settings"), Ask(), SettingsReport, ASK_S)
        members = {
            f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body
            for answer in described
        }
        told = {
            f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body
            for answer in settings
        }
        metadata = {
            "hmcs": as_fields(
                {
                    "version": importlib.metadata.version("hmcs"),
                    "cell": bus.settings.cell,
                    "begun": _now().isoformat(),
                }
            )
        }
        for member, description in members.items():
            facts = {"version": description.version, **description.facts}
            if member in told:
                facts["settings"] = json.dumps(told[member].settings)
            metadata[member] = as_fields(facts)
        return Preface(metadata, {file.name: file.read_bytes() for file in self._models()})

    def _models(self) -> list[Path]:
        found: list[Path] = []
        for place in self.settings.models:
            found += sorted(place.glob("*.hmcs")) if place.is_dir() else [place]
        return [file for file in found if file.is_file()]


def _now() -> datetime:
    return datetime.now(UTC)
