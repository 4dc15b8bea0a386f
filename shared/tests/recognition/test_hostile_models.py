"""Model files made to do harm are refused before anything of them is unpacked or computed with."""

from __future__ import annotations

import contextlib
import io
import json
import os
import struct
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.recognition.model import Model
from hmcs.recognition.model_archive import (
    DEEPEST,
    MOST_BYTES,
    MOST_ENTRIES,
    MOST_MANIFEST_BYTES,
    MOST_VALUES,
)
from hmcs.recognition.model_file import ModelFileError, load_model, save_model

MEANS = "arrays/parameters.means.npy"
Parts = dict[str, bytes]


@pytest.fixture(scope="session")
def parts(model: Model, tmp_path_factory: pytest.TempPathFactory) -> Parts:
    """The entries of a model file that is right."""
    path = tmp_path_factory.mktemp("right") / "m.hmcs"
    save_model(model, path)
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(parts: Parts, how: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(buffer, "w", how) as archive:
        warnings.simplefilter("ignore")
        for name, content in parts.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def refused(tmp_path: Path, content: bytes) -> str:
    path = tmp_path / "m.hmcs"
    path.write_bytes(content)
    with pytest.raises(ModelFileError) as caught:
        load_model(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def array(header: str, data: bytes = bytes(8)) -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def shaped(shape: str, data: bytes = bytes(8), kind: str = "<f8") -> bytes:
    return array(f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}", data)


def said(manifest: bytes, change: Callable[[dict[str, Any]], None]) -> bytes:
    fields = json.loads(manifest)
    change(fields)
    return json.dumps(fields).encode()


def test_a_right_file_packed_anew_is_read(parts: Parts, tmp_path: Path) -> None:
    for how in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        (tmp_path / "m.hmcs").write_bytes(packed(parts, how))
        assert load_model(tmp_path / "m.hmcs").name == "corner"


def test_an_array_in_the_order_of_fortran_is_read(parts: Parts, tmp_path: Path) -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.asfortranarray(np.load(io.BytesIO(parts[MEANS]))))
    (tmp_path / "m.hmcs").write_bytes(packed({**parts, MEANS: buffer.getvalue()}))
    assert load_model(tmp_path / "m.hmcs").name == "corner"


ARRAYS = {
    "it says more than there is": (shaped("(1000000000000000,)"), "says it has shape"),
    "it says less than there is": (shaped("(1,)", bytes(16)), "says it has shape"),
    "a size below zero": (shaped("(-1,)"), "does not begin"),
    "no size times a large one": (shaped("(0, 999999999999, 999999999999)", b""), "missing|array"),
    "many dimensions": (shaped(f"({'1, ' * 40})"), "does not begin"),
    "objects": (shaped("(1,)", kind="|O"), "does not begin"),
    "text": (shaped("(1,)", kind="<U2"), "does not begin"),
    "complex numbers": (shaped("(1,)", kind="<c8"), "does not begin"),
    "an impossible kind": (shaped("(1,)", b"x", kind="<f1"), "cannot be read"),
    "a call in the header": (
        array("{'descr': __import__('os').system('exit 7'), 'fortran_order': False, 'shape': ()}"),
        "does not begin",
    ),
    "brackets in the header": (array("(" * 110), "does not begin"),
    "a long header": (
        b"\x93NUMPY\x02\x00" + struct.pack("<I", 10**6) + b"(" * 10**6,
        "does not begin",
    ),
    "another version": (shaped("(1,)").replace(b"\x01\x00", b"\x03\x00", 1), "does not begin"),
    "nothing": (b"", "does not begin"),
    "half a header": (shaped("(1,)")[:40], "does not begin"),
    "no numbers": (b"hello", "does not begin"),
}


@pytest.mark.parametrize(("content", "says"), ARRAYS.values(), ids=ARRAYS)
def test_an_array_that_is_none_is_refused(
    parts: Parts, tmp_path: Path, content: bytes, says: str
) -> None:
    reported = refused(tmp_path, packed({**parts, MEANS: content}))
    assert any(word in reported for word in says.split("|")), reported


MANIFESTS: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "deep lists": (lambda _: b"[" * 200_000, "no JSON that is read"),
    "deeper than a task": (lambda _: b"[" * 40 + b"]" * 40, f"more than {DEEPEST} levels"),
    "many values": (lambda _: b"[" + b"1," * MOST_VALUES + b"1]", "more than 200,000 values"),
    "a large text": (lambda _: b'"' + b"x" * MOST_MANIFEST_BYTES + b'"', "expected at most"),
    "not a number": (lambda m: m.replace(b": 0.01", b": NaN", 1), "NaN is no number"),
    "infinity": (lambda m: m.replace(b": 0.01", b": -Infinity", 1), "no number"),
    "a number beyond all": (lambda m: m.replace(b": 0.01", b": 1e400", 1), "not finite"),
    "a long integer": (lambda m: m.replace(b": 0.01", b": " + b"9" * 10_000, 1), "no JSON"),
    "an integer of 67 bits": (lambda m: m.replace(b": 0.01", b": " + b"9" * 20, 1), "64 bits"),
    "half a surrogate pair": (
        lambda m: m.replace(b"Along, round", b"\\ud800", 1),
        "surrogate pair",
    ),
    "a key twice": (lambda m: m.replace(b'"format"', b'"name": "x", "format"', 1), "twice"),
    "no text": (lambda _: b"\xff\xfe", "no JSON"),
    "no mapping": (lambda _: b"[]", "format None"),
    "a name that is no name": (
        lambda m: said(m, lambda f: f.update(name="evil name")),
        "name: ",
    ),
    "an array without a name": (
        lambda m: said(m, lambda f: f["knowledge"]["parameters"].update(means={"$array": [1]})),
        "expected its name",
    ),
    "an array of another name": (
        lambda m: said(m, lambda f: f["knowledge"]["parameters"].update(means={"$array": "x"})),
        "'x' is missing",
    ),
    "another task": (
        lambda m: said(m, lambda f: f["task"]["gestemes"].append({"name": "more"})),
        "array 'guide.path.3' is missing",
    ),
    "a kind that is a path": (
        lambda m: said(m, lambda f: f.update(recognizer="../../evil")),
        "unknown recognizer",
    ),
}


@pytest.mark.parametrize(("change", "says"), MANIFESTS.values(), ids=MANIFESTS)
def test_a_manifest_that_is_none_is_refused(
    parts: Parts, tmp_path: Path, change: Callable[[bytes], bytes], says: str
) -> None:
    changed = change(parts["model.json"])
    assert changed != parts["model.json"]
    assert says in refused(tmp_path, packed({**parts, "model.json": changed}, zipfile.ZIP_STORED))


@pytest.mark.parametrize(
    "name", ["arrays/extra.npy", "arrays/../../x.npy", "/etc/x.npy", "extra", "arrays/", "a" * 9999]
)
def test_an_entry_that_no_model_has_is_refused(parts: Parts, tmp_path: Path, name: str) -> None:
    reported = refused(tmp_path, packed({**parts, name: shaped("(1,)")}))
    assert "none of this model" in reported or "no part of a model" in reported
    assert len(reported) < 500


def test_a_name_that_stands_twice_is_refused(parts: Parts, tmp_path: Path) -> None:
    buffer = io.BytesIO(packed(parts))
    with warnings.catch_warnings(), zipfile.ZipFile(buffer, "a") as archive:
        warnings.simplefilter("ignore")
        archive.writestr(MEANS, parts[MEANS])
    assert "twice" in refused(tmp_path, buffer.getvalue())


def test_more_entries_than_any_model_has_are_refused(parts: Parts, tmp_path: Path) -> None:
    many = {f"arrays/{k}.npy": b"" for k in range(MOST_ENTRIES)}
    assert "entries" in refused(tmp_path, packed({**parts, **many}, zipfile.ZIP_STORED))


@pytest.mark.parametrize("how", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_ways_of_packing_are_refused(parts: Parts, tmp_path: Path, how: int) -> None:
    assert "packed in a way" in refused(tmp_path, packed(parts, how))


def directory_of(content: bytes, name: str) -> int:
    """Where the directory of an archive tells of an entry."""
    at = -1
    while (at := content.find(b"PK\x01\x02", at + 1)) >= 0:
        length = struct.unpack_from("<H", content, at + 28)[0]
        if content[at + 46 : at + 46 + length] == name.encode():
            return at
    raise LookupError(name)


def with_directory(content: bytes, name: str, offset: int, kind: str, value: int) -> bytes:
    changed = bytearray(content)
    struct.pack_into(kind, changed, directory_of(content, name) + offset, value)
    return bytes(changed)


@pytest.mark.parametrize(
    ("offset", "kind", "value"),
    [
        (8, "<H", 0x1),  # encrypted
        (8, "<H", 0x20),  # patched data
        (8, "<H", 0x40),  # strong encryption
        (10, "<H", 99),  # a method nobody knows
        (6, "<H", 90),  # needs a later version
        (16, "<I", 1),  # another checksum
        (20, "<I", 5),  # less packed than there is
        (24, "<I", 5),  # unpacks to more than it says
        (24, "<I", 2**32 - 1),  # says it is 4 GB
        (30, "<H", 9),  # an extra field that is none
        (42, "<I", 2**31),  # begins beyond the end
        (42, "<I", 0),  # begins where another one does
    ],
)
def test_a_directory_that_lies_is_refused(
    parts: Parts, tmp_path: Path, offset: int, kind: str, value: int
) -> None:
    refused(tmp_path, with_directory(packed(parts), MEANS, offset, kind, value))


def bomb(bytes_: int) -> bytes:
    head = shaped(f"({bytes_ // 8},)", b"")
    return head + bytes(bytes_)


def test_what_unpacks_to_too_much_is_refused_before_it_is_unpacked(
    parts: Parts, tmp_path: Path
) -> None:
    content = packed({**parts, MEANS: bomb(20_000_000)})
    assert len(content) < 100_000
    assert "times those of the file" in refused(tmp_path, content)


@pytest.mark.long
def test_a_bomb_that_lies_about_its_size_unpacks_to_no_more_than_it_says(
    parts: Parts, tmp_path: Path
) -> None:
    unpacked_mb = 400
    path = tmp_path / "m.hmcs"
    content = packed({**parts, MEANS: bomb(unpacked_mb * 10**6)})
    path.write_bytes(with_directory(content, MEANS, 24, "<I", 1_000))
    # In a process of its own, whose memory nothing else has grown.
    code = f"""
from resource import RUSAGE_SELF, getrusage
from hmcs.recognition.model_file import ModelFileError, load_model
before_kb = getrusage(RUSAGE_SELF).ru_maxrss
try:
    load_model({str(path)!r})
except ModelFileError as error:
    print((getrusage(RUSAGE_SELF).ru_maxrss - before_kb) // 1000, error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    grown_mb, _, reported = done.stdout.partition(" ")
    assert "arrays/parameters.means.npy is damaged" in reported, done
    assert int(grown_mb) < unpacked_mb / 2


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, "/dev/zero", "a\0b", "x" * 5_000):
        with pytest.raises(ModelFileError, match="make one with `hmcs train`"):
            load_model(place)


def test_a_large_file_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "m.hmcs").open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    with pytest.raises(ModelFileError, match="larger than"):
        load_model(tmp_path / "m.hmcs")


@pytest.mark.long
@settings(max_examples=400, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_a_file_damaged_anywhere_is_refused_or_still_the_model_it_was(
    parts: Parts, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = bytearray(packed(parts, data.draw(st.sampled_from([0, 8]))))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        patch = data.draw(
            st.binary(min_size=1, max_size=8) | st.sampled_from([b"\xff" * 8, bytes(4), b"PK\1\2"])
        )
        if data.draw(st.booleans()):
            content[at : at + len(patch)] = patch
        else:
            content[at:at] = patch
    path = tmp_path_factory.getbasetemp() / "damaged.hmcs"
    path.write_bytes(content)
    with contextlib.suppress(ModelFileError):
        assert load_model(path).name == "corner"
