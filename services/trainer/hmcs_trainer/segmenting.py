"""What a model finds in a recording, when somebody asks: in a process of its own, one at a time."""

from __future__ import annotations

import contextlib
import logging
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from hmcs.bus.messages import ModelFile, Segmentation, SegmentQuestion
from hmcs.bus.session import RequestRefusedError
from hmcs.errors import UserError
from hmcs.recognition.model_file import load_model, model_files
from hmcs.recordings.file_rotation import SUFFIX as RECORDING
from hmcs_trainer.asked import own_file
from hmcs_trainer.segment_job import Found, SegmentJob

MOST_MODELS = 256
"""Files that are looked through for a model."""
_COMMAND = (sys.executable, "-m", "hmcs_trainer.segment_job")


class Segmenting:
    """Answers what the parts of a recording are; called on threads beside the loop."""

    def __init__(
        self,
        folder: Path,
        sources: Sequence[Path],
        longest_s: float,
        fetch: Callable[[str], ModelFile | None],
        log: logging.Logger,
    ) -> None:
        """Read models and recordings that lie in `folder` or `sources`, and no other.

        `fetch` asks other processes for the file of a model that is none of those, by its name.
        """
        self._folder = folder
        self._sources = sources
        self._longest_s = longest_s
        self._fetch = fetch
        self._log = log
        self._busy = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._closed = False

    def segmentation(self, asked: SegmentQuestion) -> Segmentation:
        """Return the parts of a recording by a model.

        Raises RequestRefusedError while another one is being found, where recording or model are
        not in the trainer's folders, nor the model loaded by a fixture controller, where it takes
        too long, and where `found_in` refuses it.
        """
        if not self._busy.acquire(blocking=False):
            raise RequestRefusedError("another recording is being segmented: ask again in a moment")
        try:
            places = (self._folder, *self._sources)
            recording = own_file(asked.recording, places, "a recording", (RECORDING,))
            with self._model_file(asked, places) as model:
                found = self._found(SegmentJob(recording=recording, model=model))
        finally:
            self._busy.release()
        if found.error:
            raise RequestRefusedError(found.error)
        segments = found.segments
        return Segmentation(
            recording=recording.name,
            model=asked.model,
            begin_s=np.array([segment.begin_s for segment in segments]),
            end_s=np.array([segment.end_s for segment in segments]),
            states=tuple(segment.state for segment in segments),
            probability=np.array([segment.probability for segment in segments]),
        )

    def close(self) -> None:
        """End what is being done."""
        self._closed = True
        process = self._process
        if process is not None:
            process.kill()

    @contextlib.contextmanager
    def _model_file(self, asked: SegmentQuestion, places: Sequence[Path]) -> Iterator[Path]:
        """The file of a model, fetched for a while where it does not lie here."""
        here = file_with_hash(asked.model_hash, asked.model, places)
        if here is not None:
            yield here
            return
        fetched = self._fetch(asked.model)
        if fetched is None or fetched.model_hash != asked.model_hash:
            raise RequestRefusedError(
                f"model {asked.model!r} {asked.model_hash[:16]!r} is no file in the trainer's "
                f"folders ({', '.join(str(place.resolve()) for place in places)}), and no fixture "
                "controller has it loaded: put its file there"
            )
        with tempfile.TemporaryDirectory(prefix="hmcs-") as folder:
            file = Path(folder) / "fetched.hmcs"
            file.write_bytes(fetched.content)
            yield file

    def _found(self, job: SegmentJob) -> Found:
        try:
            with subprocess.Popen(
                _COMMAND,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
            ) as process:
                self._process = process
                if self._closed:
                    process.kill()
                try:
                    said, complaint = process.communicate(job.model_dump_json(), self._longest_s)
                except subprocess.TimeoutExpired:
                    process.kill()
                    raise RequestRefusedError(
                        f"{job.recording.name}: given up, it took longer than "
                        f"{self._longest_s:g} s: use `hmcs segment`"
                    ) from None
        except OSError as error:
            raise RequestRefusedError(
                f"no segmentation can begin here: {error.strerror}: see the trainer's log"
            ) from error
        finally:
            self._process = None
        try:
            return Found.model_validate_json(said)
        except ValidationError:
            self._log.warning(
                "a segmentation failed",
                extra={"recording": job.recording.name, "said": complaint[-2000:]},
            )
            raise RequestRefusedError(
                f"{job.recording.name}: the process that segments it ended with "
                f"{process.returncode}: the trainer's log says why"
            ) from None


def file_with_hash(model_hash: str, name: str, places: Sequence[Path]) -> Path | None:
    """Return the file of a model in some folders, or among files; those of its name first."""
    files = [
        file
        for place in places
        for file in model_files(place, may_be_empty=True)
        if file.suffix == ".hmcs"
    ]
    for file in sorted(files, key=lambda file: file.stem != name)[:MOST_MODELS]:
        # One that is broken, or half written, is not the one that is meant.
        with contextlib.suppress(UserError, OSError):
            if load_model(file).hash == model_hash:
                return file
    return None
