"""Model files come back as they were, and every damage is told."""

import json
import zipfile

import numpy as np
import pytest

from hmcs.recognition.model_file import ModelFileError, load_model, save_model, with_hash


@pytest.fixture
def saved(model, tmp_path):
    path = tmp_path / "corner.hmcs"
    return save_model(model, path), path


def rewritten(path, change):
    """Unpack, let `change(manifest, arrays)` spoil it, pack again."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    manifest = json.loads(parts["model.json"])
    change(manifest, parts)
    parts["model.json"] = json.dumps(manifest).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


def test_a_model_comes_back_as_it_was(saved):
    model, path = saved
    loaded = load_model(path)
    assert loaded.hash == model.hash
    assert loaded.task == model.task
    assert (loaded.scoring, loaded.filter_settings, loaded.alarm) == (
        model.scoring,
        model.filter_settings,
        model.alarm,
    )
    for ours, theirs in zip(model.parameters, loaded.parameters, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert loaded.demonstrations == ("seed-0", "seed-1", "seed-2", "seed-3")
    assert set(loaded.paths) == {"along", "round", "up"}


def test_equal_models_make_equal_files(model, tmp_path):
    save_model(model, tmp_path / "a")
    save_model(model, tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a", "b"]


def test_the_hash_tells_models_apart(model):
    changed = model._replace(scoring=model.scoring._replace(temperature=5.0))
    assert with_hash(changed).hash != with_hash(model).hash


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(ModelFileError, match=r"no such model file.*hmcs train"):
        load_model(tmp_path / "none.hmcs")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_told(saved, share):
    _, path = saved
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(ModelFileError, match="no model file, or a truncated one"):
        load_model(path)


def _another_version(manifest, _):
    manifest["format"] = "hmcs-model/9"


def _no_scoring(manifest, _):
    del manifest["scoring"]


def _other_temperature(manifest, _):
    manifest["scoring"][1] = 9.0


def _drop_array(_, parts):
    del parts["arrays/means.npy"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_another_version, "format 'hmcs-model/9', expected 'hmcs-model/1'"),
        (_no_scoring, "not a complete model"),
        (_other_temperature, "checksum"),
        (_drop_array, "not a complete model"),
    ],
)
def test_a_changed_file_is_told(saved, change, message):
    _, path = saved
    rewritten(path, change)
    with pytest.raises(ModelFileError, match=message):
        load_model(path)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("means", np.nan, "'means' holds numbers that are not finite"),
        ("variances", 0.0, "positive variances"),
    ],
)
def test_numbers_that_cannot_be_are_told(model, tmp_path, field, value, message):
    array = getattr(model.parameters, field).copy()
    array.flat[3] = value
    spoiled = model._replace(parameters=model.parameters._replace(**{field: array}))
    save_model(spoiled, tmp_path / "m")
    with pytest.raises(ModelFileError, match=message):
        load_model(tmp_path / "m")


def test_arrays_that_do_not_fit_together_are_told(model, tmp_path):
    short = model.parameters._replace(leave=model.parameters.leave[:, :-1])
    save_model(model._replace(parameters=short), tmp_path / "m")
    with pytest.raises(ModelFileError, match="'leave' is float64 of shape"):
        load_model(tmp_path / "m")
