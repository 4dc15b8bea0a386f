"""The committed contract is the one the code speaks."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from pydantic import create_model

from hmcs.bus import schemas
from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import MESSAGES, Step
from hmcs.bus.wire import decode, encode, schema_of

CONTRACT = Path(__file__).parent
VERSIONED = re.compile(r"([a-z_]+)-(\d+)\.(json|bin)")


def test_no_message_changed_without_a_new_version() -> None:
    assert schemas.drifted_files(CONTRACT) == []


def test_every_message_is_committed_word_for_word() -> None:
    for path, content in schemas.contract_files().items():
        assert (CONTRACT / path).read_bytes() == content, f"{path}: run `make schemas`"


def test_there_is_one_example_of_every_message() -> None:
    assert [type(example) for example in EXAMPLES] == list(MESSAGES)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: type(example).__name__)
def test_golden_bytes_read_as_their_example_and_are_written_again_alike(example) -> None:
    name = schema_of(type(example)).replace("/", "-")
    golden = (CONTRACT / "golden" / f"{name}.bin").read_bytes()
    envelope, body = decode(golden, type(example))
    assert envelope == ENVELOPE
    assert encode(body, envelope) == golden


def test_every_committed_file_belongs_to_a_version_that_was_or_is() -> None:
    versions = {message.SCHEMA: message.VERSION for message in MESSAGES}
    for path in [*(CONTRACT / "schemas").iterdir(), *(CONTRACT / "golden").iterdir()]:
        match = VERSIONED.fullmatch(path.name)
        assert match, path
        assert int(match[2]) <= versions[match[1]], path


@pytest.mark.parametrize("message", MESSAGES, ids=schema_of)
def test_a_schema_tells_of_every_field_on_the_wire(message) -> None:
    schema = schemas.wire_schema(message)
    assert set(schema["properties"]) == {
        "schema", "source", "seq", "origin", *message.model_fields
    }  # fmt: skip
    for name, field in schema["properties"].items():
        assert name in ("schema", "source") or "description" in field or "$ref" in field, name


@pytest.fixture
def step_contract(tmp_path, monkeypatch):
    """A contract folder of Step alone, and a function that gives Step another version or field."""
    example = next(example for example in EXAMPLES if isinstance(example, Step))
    monkeypatch.setattr(schemas, "MESSAGES", (Step,))
    assert schemas.main([str(tmp_path)]) == 0

    def change(version: int, *, doc: str = "", **fields: Any) -> None:
        changed = create_model("Step", __base__=Step, __doc__=doc or Step.__doc__, **fields)
        changed.VERSION = version
        new = changed(**example.__dict__, **dict.fromkeys(fields, 1))
        monkeypatch.setattr(schemas, "MESSAGES", (changed,))
        monkeypatch.setattr(schemas, "EXAMPLES", (new,))

    return tmp_path, change


def test_a_change_without_a_new_version_is_drift_and_is_not_written(step_contract, capsys) -> None:
    folder, change = step_contract
    before = (folder / "schemas/step-1.json").read_bytes()
    change(1, speed=(int, ...))
    assert "schemas/step-1.json" in schemas.drifted_files(folder)
    assert "golden/step-1.bin" in schemas.drifted_files(folder)
    assert schemas.main([str(folder)]) == 1
    assert "Raise VERSION" in capsys.readouterr().err
    assert (folder / "schemas/step-1.json").read_bytes() == before


def test_a_new_version_gets_files_of_its_own_beside_the_old(step_contract) -> None:
    folder, change = step_contract
    before = (folder / "golden/step-1.bin").read_bytes()
    change(2, speed=(int, ...))
    assert schemas.main([str(folder)]) == 0
    assert json.loads((folder / "schemas/step-2.json").read_text())["$id"] == "step/2"
    assert (folder / "golden/step-1.bin").read_bytes() == before


def test_other_words_are_no_drift_and_are_brought_up_to_date(step_contract) -> None:
    folder, change = step_contract
    change(1, doc="Another way to say it.")
    assert schemas.drifted_files(folder) == []
    assert schemas.main([str(folder)]) == 0
    schema = json.loads((folder / "schemas/step-1.json").read_text())
    assert schema["description"] == "Another way to say it."
