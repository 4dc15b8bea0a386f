"""Model files come back as they were, and every damage is reported."""

import json
import zipfile

import numpy as np
import pytest

from hmcs.recognition.model_file import ModelFileError, load_model, save_model, with_hash
from hmcs.recognition.serialization import to_arrays


@pytest.fixture
def saved(model, tmp_path):
    path = tmp_path / "corner.hmcs"
    return save_model(model, path), path


def with_parameters(model, **changed):
    parameters = model.knowledge.parameters._replace(**changed)
    return model._replace(knowledge=model.knowledge._replace(parameters=parameters))


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
    assert loaded.recognizer == "segment-filter"
    ours, theirs = to_arrays(model.knowledge), to_arrays(loaded.knowledge)
    assert ours.plain == theirs.plain
    for name, array in ours.arrays.items():
        np.testing.assert_array_equal(array, theirs.arrays[name], name)
    assert loaded.demonstrations == ("seed-0", "seed-1", "seed-2", "seed-3")
    assert set(loaded.paths) == {"along", "round", "up"}


def test_equal_models_make_equal_files(model, tmp_path):
    save_model(model, tmp_path / "a")
    save_model(model, tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["a", "b"]


def test_the_hash_tells_models_apart(model):
    scoring = model.knowledge.scoring._replace(temperature=5.0)
    changed = model._replace(knowledge=model.knowledge._replace(scoring=scoring))
    assert with_hash(changed).hash != with_hash(model).hash


def test_a_missing_file_is_reported(tmp_path):
    with pytest.raises(ModelFileError, match=r"no such model file.*hmcs train"):
        load_model(tmp_path / "none.hmcs")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_file_is_reported(saved, share):
    _, path = saved
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(ModelFileError, match="no model file, or a truncated one"):
        load_model(path)


def _another_version(manifest, _):
    manifest["format"] = "hmcs-model/9"


def _no_scoring(manifest, _):
    del manifest["knowledge"]["scoring"]


def _another_recognizer(manifest, _):
    manifest["recognizer"] = "oracle"


def _other_temperature(manifest, _):
    manifest["knowledge"]["scoring"]["temperature"] = 9.0


def _drop_array(_, parts):
    del parts["arrays/parameters.means.npy"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_another_version, "format 'hmcs-model/9', expected 'hmcs-model/1'"),
        (_no_scoring, "not a complete model: scoring"),
        (_another_recognizer, "unknown recognizer 'oracle' .*segment-filter"),
        (_other_temperature, "checksum"),
        (_drop_array, "not a complete model"),
    ],
)
def test_a_changed_file_is_reported(saved, change, message):
    _, path = saved
    rewritten(path, change)
    with pytest.raises(ModelFileError, match=message):
        load_model(path)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("means", np.nan, "'parameters.means' holds numbers that are not finite"),
        ("variances", 0.0, "positive variances"),
    ],
)
def test_numbers_that_cannot_be_are_reported(model, tmp_path, field, value, message):
    array = getattr(model.knowledge.parameters, field).copy()
    array.flat[3] = value
    save_model(with_parameters(model, **{field: array}), tmp_path / "m")
    with pytest.raises(ModelFileError, match=message):
        load_model(tmp_path / "m")


def test_arrays_that_do_not_fit_together_are_reported(model, tmp_path):
    short = model.knowledge.parameters.skip[:, :-1]
    save_model(with_parameters(model, skip=short), tmp_path / "m")
    with pytest.raises(ModelFileError, match="'skip' is float64 of shape"):
        load_model(tmp_path / "m")
