"""Saved models: one self-describing, versioned, checksummed file of arrays and JSON.

A model file is a zip archive: `model.json` says what the model is and what it was learned from,
`arrays/*.npy` hold its numbers. Nothing in it is code; `unzip` and numpy open it anywhere.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from hmcs.errors import UserError
from hmcs.recognition.gestemes import GestemeParameters, Scoring
from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter import FilterSettings
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

FORMAT = "hmcs-model/1"
RECOGNIZER = "segment-filter"

_MANIFEST = "model.json"
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
    scoring: Scoring
    filter_settings: FilterSettings
    alarm: AlarmSettings
    demonstrations: tuple[str, ...]


def with_hash(model: Model) -> Model:
    """Return the model with the hash of its content."""
    return model._replace(hash=_digest(model))


def save_model(model: Model, path: str | Path) -> Model:
    """Write the model file, whole or not at all, and return the model with its hash."""
    model = with_hash(model)
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
            manifest = json.dumps(_manifest(model), indent=2, sort_keys=True)
            archive.writestr(zipfile.ZipInfo(_MANIFEST, _EPOCH), manifest)
            for name, array in _arrays(model).items():
                buffer = io.BytesIO()
                np.save(buffer, array, allow_pickle=False)
                archive.writestr(zipfile.ZipInfo(f"arrays/{name}.npy", _EPOCH), buffer.getvalue())
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)
    return model


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
                Path(name).stem: np.load(io.BytesIO(archive.read(name)), allow_pickle=False)
                for name in archive.namelist()
                if name.startswith("arrays/")
            }
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError, OSError) as error:
        raise ModelFileError(
            f"{source}: no model file, or a truncated one ({error}): train it again"
        ) from error
    return _model(source, fields, arrays)


def _model(source: Path, fields: Any, arrays: dict[str, NDArray[np.float64]]) -> Model:
    version = fields.get("format") if isinstance(fields, dict) else None
    if version != FORMAT:
        raise ModelFileError(
            f"{source}: format {version!r}, expected {FORMAT!r}: train the model again "
            "with this version of hmcs"
        )
    try:
        manifest = Manifest.model_validate(fields)
        gestemes = [gesteme.name for gesteme in manifest.task.gestemes]
        model = Model(
            name=manifest.name,
            hash=manifest.hash,
            task=manifest.task,
            parameters=GestemeParameters(
                **{field: arrays[field] for field in GestemeParameters._fields}
            ),
            scoring=manifest.scoring,
            filter_settings=manifest.filter_settings,
            alarm=manifest.alarm,
            path_points=tuple(arrays[f"path_{k}"] for k in range(len(gestemes))),
            path_spreads=tuple(arrays[f"spread_{k}"] for k in range(len(gestemes))),
            demonstrations=manifest.demonstrations,
        )
    except (ValidationError, KeyError) as error:
        raise ModelFileError(f"{source}: not a complete model: {error}") from error
    _check_arrays(source, model)
    if _digest(model) != model.hash:
        raise ModelFileError(f"{source}: damaged, its checksum does not fit: train it again")
    return model


def _check_arrays(source: Path, model: Model) -> None:
    gestemes, phases = model.parameters.initial.shape[:1], model.parameters.initial.shape
    emissions = (*phases, 2 * len(model.axes))
    expected: dict[str, tuple[int, ...]] = {
        field: emissions if field in ("means", "variances") else phases
        for field in GestemeParameters._fields
    }
    for k, points in enumerate(model.path_points):
        expected |= {f"path_{k}": (len(points), 3), f"spread_{k}": (len(points),)}
    for name, array in _arrays(model).items():
        if array.shape != expected[name] or array.dtype != np.float64:
            raise ModelFileError(
                f"{source}: array {name!r} is {array.dtype} of shape {array.shape}, "
                f"expected float64 of shape {expected[name]}"
            )
        if not np.isfinite(array).all():
            raise ModelFileError(f"{source}: array {name!r} holds numbers that are not finite")
    if gestemes != (len(model.task.gestemes),) or not (model.parameters.variances > 0).all():
        raise ModelFileError(
            f"{source}: its arrays are for {gestemes[0]} gestemes with positive variances, "
            f"its task has {len(model.task.gestemes)}"
        )


def _manifest(model: Model) -> dict[str, Any]:
    return Manifest(
        format=FORMAT,
        recognizer=RECOGNIZER,
        name=model.name,
        hash=model.hash,
        task=model.task,
        scoring=model.scoring,
        filter_settings=model.filter_settings,
        alarm=model.alarm,
        demonstrations=model.demonstrations,
    ).model_dump(mode="json")


def _arrays(model: Model) -> dict[str, NDArray[np.float64]]:
    arrays: dict[str, NDArray[np.float64]] = dict(model.parameters._asdict())
    for k, (points, spread) in enumerate(zip(model.path_points, model.path_spreads, strict=True)):
        arrays |= {f"path_{k}": points, f"spread_{k}": spread}
    return arrays


def _digest(model: Model) -> str:
    digest = hashlib.sha256()
    digest.update(json.dumps(_manifest(model._replace(hash="")), sort_keys=True).encode())
    for name, array in sorted(_arrays(model).items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]
