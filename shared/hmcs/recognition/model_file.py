"""Saved models: one self-describing, versioned, checksummed file of arrays and JSON.

A model file is a zip archive: `model.json` says what the model is and what it was learned from,
`arrays/*.npy` hold its numbers. Nothing in it is code; `unzip` and numpy open it anywhere.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.errors import UserError, first_problem
from hmcs.recognition.checking import LARGEST, check_shapes, check_within
from hmcs.recognition.model import Model
from hmcs.recognition.model_archive import ARRAYS, MANIFEST, MOST_BYTES, Archive, ArchiveError
from hmcs.recognition.registry import kind_named
from hmcs.recognition.serialization import (
    AnyArray,
    Content,
    array_names,
    from_arrays,
    to_arrays,
)
from hmcs.task import Task, load_task
from hmcs.task.values import Name
from hmcs.whole_files import written_whole

FORMAT = "hmcs-model/1"
MOST_POINTS = 10_000
"""Of a guide's path."""

_PATH, _SPREAD, _TURN = "guide.path.", "guide.spread.", "guide.turn."
_EPOCH = (1980, 1, 1, 0, 0, 0)


class ModelFileError(UserError):
    """A model file that cannot be used; says which, what is wrong, and what to do."""


class Manifest(BaseModel):
    """The JSON part of a model file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: str
    recognizer: str
    name: Name
    hash: Annotated[str, Field(max_length=64)]
    task: Task
    knowledge: Any
    """Of the recognizer; where an array stands there is `{"$array": its name}`."""
    demonstrations: tuple[str, ...]


def with_hash(model: Model) -> Model:
    """Return the model with the hash of its content."""
    return model._replace(hash=_digest(model))


def save_model(model: Model, path: str | Path) -> Model:
    """Write the model file, whole or not at all, and return the model with its hash."""
    model = with_hash(model)
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    with (
        written_whole(target) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        manifest, arrays = _parts(model)
        text = json.dumps(manifest, indent=2, sort_keys=True)
        archive.writestr(zipfile.ZipInfo(MANIFEST, _EPOCH), text)
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, array, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{ARRAYS}{name}.npy", _EPOCH), buffer.getvalue())
    return model


def model_files(place: Path, *, may_be_empty: bool = False) -> list[Path]:
    """Return a model file, or those of a folder of `*.hmcs` files by name.

    Raises UserError for a folder without any, unless it may be empty.
    """
    if not place.is_dir():
        return [place]
    files = sorted(place.glob("*.hmcs"))
    if not files and not may_be_empty:
        raise UserError(
            f"{place}: no model file (*.hmcs) in this folder: make one with `hmcs train`"
        )
    return files


def model_file_of(place: Path, task: str | None) -> Path | None:
    """Return a model file: `place`, or of a folder the file named as a task, if it has that file.

    `task` is a name or a file, as of `load_task`. Raises UserError for a folder without a task,
    TaskFileError for a task that cannot be read.
    """
    if not place.is_dir():
        return place
    if task is None:
        raise UserError(f"{place}: a folder of models: name the task whose model it is to be")
    file = place / f"{load_task(task).name}.hmcs"
    return file if file.is_file() else None


def asked_model(path: str) -> Path:
    """Return the path of a model file that somebody on the bus names.

    Raises ModelFileError for any other kind of file: whether it exists is nobody's business there.
    """
    if not path.endswith(".hmcs"):
        raise ModelFileError(f"{path!r}: not a model: name a file that ends in .hmcs")
    return Path(path)


def load_model(path: str | Path, *, verify: Callable[[Path, bytes], None] | None = None) -> Model:
    """Read a model file; see `model_archive` for the bounds of what is read.

    `verify` is called with the very bytes before they are decoded, and may refuse them.

    Raises ModelFileError when there is no such file, it is truncated or no model file, too large,
    of another format version, damaged (checksum), or holds numbers that are not finite, do not fit,
    or are none that its recognizer can compute with.
    """
    source = Path(path)
    try:
        content = read_bounded(source, MOST_BYTES)
    except UnreadableFileError as error:
        what = error.what.replace("no such file", "no such model file")
        raise ModelFileError(f"{source}: {what}: make one with `hmcs train`") from error
    if verify is not None:
        verify(source, content)
    return model_in(content, source)


def model_in(content: bytes, source: Path) -> Model:
    """Return the model that the content of a model file holds; errors name it as `source`.

    Raises ModelFileError as `load_model` does.
    """
    if len(content) > MOST_BYTES:
        raise ModelFileError(f"{source}: larger than {MOST_BYTES:,} bytes, the most that is read")
    try:
        with Archive(content) as archive:
            fields = archive.manifest()
            manifest = _manifest(source, fields)
            return _model(source, fields, manifest, archive)
    except ArchiveError as error:
        raise ModelFileError(
            f"{source}: no model file, or a truncated one ({error}): train it again"
        ) from error


def check_model(model: Model) -> None:
    """Raise ValueError where `load_model` would not take a model's knowledge or guides."""
    kind = kind_named(model.recognizer)
    from_arrays(kind.knowledge, to_arrays(model.knowledge))
    kind.check(model.knowledge, model.task)
    _check_guides(model)


def _manifest(source: Path, fields: Any) -> Manifest:
    version = fields.get("format") if isinstance(fields, dict) else None
    if version != FORMAT:
        raise ModelFileError(
            f"{source}: format {version!r:.40}, expected {FORMAT!r}: train the model again "
            "with this version of hmcs"
        )
    try:
        return Manifest.model_validate(fields)
    except ValidationError as error:
        where, why = first_problem(error)
        raise ModelFileError(f"{source}: not a complete model: {where}: {why:.300}") from error


def _model(source: Path, fields: dict[str, Any], manifest: Manifest, archive: Archive) -> Model:
    try:
        kind = kind_named(manifest.recognizer)
        gestemes = range(len(manifest.task.gestemes))
        guides = [f"{begin}{k}" for begin in (_PATH, _SPREAD) for k in gestemes]
        own = array_names(manifest.knowledge)
        arrays = archive.arrays([*guides, *own], [f"{_TURN}{k}" for k in gestemes])
        knowledge: Any = from_arrays(
            kind.knowledge,
            Content(kind.from_older(manifest.knowledge), {name: arrays[name] for name in own}),
        )
        kind.check(knowledge, manifest.task)
        turns = tuple(arrays.get(f"{_TURN}{k}") for k in gestemes)
        model = Model(
            name=manifest.name,
            hash=manifest.hash,
            task=manifest.task,
            recognizer=manifest.recognizer,
            knowledge=knowledge,
            path_points=tuple(arrays[f"{_PATH}{k}"] for k in gestemes),
            path_spreads=tuple(arrays[f"{_SPREAD}{k}"] for k in gestemes),
            demonstrations=manifest.demonstrations,
            path_turns=() if all(turn is None for turn in turns) else turns,
        )
        _check_guides(model)
    except (ValueError, LookupError, TypeError) as error:
        # LookupError, TypeError: of a kind from elsewhere, whose check takes shapes for granted.
        raise ModelFileError(f"{source}: not a complete model: {error}") from error
    except UserError as error:
        raise ModelFileError(f"{source}: {error}") from error
    # Of what stands in the file: a task may have fields by now that it has not.
    if _digest_of(fields | {"hash": ""}, arrays) != model.hash:
        raise ModelFileError(f"{source}: damaged, its checksum does not fit: train it again")
    return model


def _check_guides(model: Model) -> None:
    """Raise ValueError for a guide that is no path, no spread beside it, or no turns along it."""
    for k, (points, spread) in enumerate(zip(model.path_points, model.path_spreads, strict=True)):
        arrays = {f"{_PATH}{k}": points, f"{_SPREAD}{k}": spread}
        shapes: dict[str, tuple[int, ...]] = {f"{_PATH}{k}": (len(points), 3)}
        shapes[f"{_SPREAD}{k}"] = (len(points),)
        turns = model.path_turns[k] if model.path_turns else None
        if turns is not None:
            arrays[f"{_TURN}{k}"] = turns
            shapes[f"{_TURN}{k}"] = (len(turns), 4)
        check_shapes(arrays, shapes)
        check_within(f"points of {_PATH}{k}", len(points), 2, MOST_POINTS)
        check_within(f"{_PATH}{k}", points, -LARGEST, LARGEST)
        check_within(f"{_SPREAD}{k}", spread, 0.0, LARGEST)
        if (points == points[0]).all():
            raise ValueError(f"array '{_PATH}{k}' never moves, expected a path")
        if turns is not None:
            check_within(f"turns of {_TURN}{k}", len(turns), 2, MOST_POINTS)
            check_within(f"length of {_TURN}{k}", np.linalg.norm(turns, axis=1), 0.999, 1.001)


def _parts(model: Model) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    """Return the manifest as JSON, and the arrays by name."""
    content = to_arrays(model.knowledge)
    arrays = dict(content.arrays)
    for k, (points, spread) in enumerate(zip(model.path_points, model.path_spreads, strict=True)):
        arrays |= {f"{_PATH}{k}": points, f"{_SPREAD}{k}": spread}
    for k, turns in enumerate(model.path_turns):
        if turns is not None:
            arrays[f"{_TURN}{k}"] = turns
    manifest = Manifest(
        format=FORMAT,
        recognizer=model.recognizer,
        name=model.name,
        hash=model.hash,
        task=model.task,
        knowledge=content.plain,
        demonstrations=model.demonstrations,
    )
    return manifest.model_dump(mode="json"), arrays


def _digest(model: Model) -> str:
    return _digest_of(*_parts(model._replace(hash="")))


def _digest_of(manifest: Mapping[str, Any], arrays: Mapping[str, AnyArray]) -> str:
    digest = hashlib.sha256()
    digest.update(json.dumps(manifest, sort_keys=True).encode())
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]
