"""Saved models: one self-describing, versioned, checksummed file of arrays and JSON.

A model file is a zip archive: `model.json` says what the model is and what it was learned from,
`arrays/*.npy` hold its numbers. Nothing in it is code; `unzip` and numpy open it anywhere.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from hmcs.errors import UserError
from hmcs.recognition.content import AnyArray, Content, ContentError, put_together, taken_apart
from hmcs.recognition.model import Model
from hmcs.recognition.recognizers import kind_named
from hmcs.task import Task
from hmcs.whole_files import written_whole

FORMAT = "hmcs-model/1"

_MANIFEST, _ARRAYS = "model.json", "arrays/"
_PATH, _SPREAD, _TURN = "guide.path.", "guide.spread.", "guide.turn."
_EPOCH = (1980, 1, 1, 0, 0, 0)


class ModelFileError(UserError):
    """A model file that cannot be used; says which, what is wrong, and what to do."""


class Manifest(BaseModel):
    """The JSON part of a model file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: str
    recognizer: str
    name: str
    hash: str
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
        archive.writestr(zipfile.ZipInfo(_MANIFEST, _EPOCH), text)
        for name, array in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, array, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{_ARRAYS}{name}.npy", _EPOCH), buffer.getvalue())
    return model


def model_files(place: Path) -> list[Path]:
    """Return a model file, or those of a folder of `*.hmcs` files by name.

    Raises UserError for a folder without any.
    """
    if not place.is_dir():
        return [place]
    files = sorted(place.glob("*.hmcs"))
    if not files:
        raise UserError(
            f"{place}: no model file (*.hmcs) in this folder: make one with `hmcs train`"
        )
    return files


def load_model(path: str | Path) -> Model:
    """Read a model file.

    Raises ModelFileError when there is no such file, it is truncated or no model file, of another
    format version, damaged (checksum), or holds numbers that are not finite or do not fit.
    """
    source = Path(path)
    if not source.is_file():
        raise ModelFileError(f"{source}: no such model file: make one with `hmcs train`")
    try:
        with zipfile.ZipFile(source) as archive:
            fields = json.loads(archive.read(_MANIFEST))
            arrays = {
                name.removeprefix(_ARRAYS).removesuffix(".npy"): np.load(
                    io.BytesIO(archive.read(name)), allow_pickle=False
                )
                for name in archive.namelist()
                if name.startswith(_ARRAYS)
            }
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError, OSError) as error:
        raise ModelFileError(
            f"{source}: no model file, or a truncated one ({error}): train it again"
        ) from error
    return _model(source, fields, arrays)


def _model(source: Path, fields: Any, arrays: dict[str, AnyArray]) -> Model:
    version = fields.get("format") if isinstance(fields, dict) else None
    if version != FORMAT:
        raise ModelFileError(
            f"{source}: format {version!r}, expected {FORMAT!r}: train the model again "
            "with this version of hmcs"
        )
    try:
        manifest = Manifest.model_validate(fields)
        kind = kind_named(manifest.recognizer)
        count = len(manifest.task.gestemes)
        paths = tuple(arrays.pop(f"{_PATH}{k}") for k in range(count))
        spreads = tuple(arrays.pop(f"{_SPREAD}{k}") for k in range(count))
        turns = tuple(arrays.pop(f"{_TURN}{k}", None) for k in range(count))
        knowledge: Any = put_together(kind.knowledge, Content(manifest.knowledge, arrays))
        kind.check(knowledge, manifest.task)
    except KeyError as error:
        raise ModelFileError(f"{source}: not a complete model: {error} is missing") from error
    except (ValidationError, ContentError, ValueError) as error:
        raise ModelFileError(f"{source}: not a complete model: {error}") from error
    except UserError as error:
        raise ModelFileError(f"{source}: {error}") from error
    model = Model(
        name=manifest.name,
        hash=manifest.hash,
        task=manifest.task,
        recognizer=manifest.recognizer,
        knowledge=knowledge,
        path_points=paths,
        path_spreads=spreads,
        demonstrations=manifest.demonstrations,
        path_turns=() if all(turn is None for turn in turns) else turns,
    )
    _check_guides(source, model)
    if _digest(model) != model.hash:
        raise ModelFileError(f"{source}: damaged, its checksum does not fit: train it again")
    return model


def _check_guides(source: Path, model: Model) -> None:
    for k, (points, spread) in enumerate(zip(model.path_points, model.path_spreads, strict=True)):
        expected = {
            f"{_PATH}{k}": (points, (len(points), 3)),
            f"{_SPREAD}{k}": (spread, points.shape[:1]),
        }
        turns = model.path_turns[k] if model.path_turns else None
        if turns is not None:
            expected[f"{_TURN}{k}"] = (turns, (len(turns), 4))
        for name, (array, shape) in expected.items():
            if array.shape != shape or array.dtype != np.float64 or not np.isfinite(array).all():
                raise ModelFileError(
                    f"{source}: array {name!r} is {array.dtype} of shape {array.shape}, "
                    f"expected finite float64 of shape {shape}"
                )


def _parts(model: Model) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    """Return the manifest as JSON, and the arrays by name."""
    content = taken_apart(model.knowledge)
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
    manifest, arrays = _parts(model._replace(hash=""))
    digest = hashlib.sha256()
    digest.update(json.dumps(manifest, sort_keys=True).encode())
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]
