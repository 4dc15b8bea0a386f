"""The contract as files: a JSON Schema and golden bytes for every version of every message.

`python -m hmcs.bus.schemas DIR` writes `DIR/schemas/motion-1.json` (JSON Schema of the whole map on
the wire), `DIR/golden/motion-1.bin` (the bytes of one example) and `DIR/golden/motion-1.json` (what
they say, for people). In files that are there already only words (titles, descriptions) are brought
up to date: peers of that version are out there, and anything else needs a new one.
"""

from __future__ import annotations

import argparse
import base64
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgpack
import numpy as np

from hmcs.bus.examples import ENVELOPE, EXAMPLES
from hmcs.bus.messages import MESSAGES, Envelope, Message
from hmcs.bus.wire import encode, schema_of

_WORDS = ("title", "description")


def wire_schema(message_type: type[Message]) -> dict[str, Any]:
    """Return the JSON Schema of a message as it is on the wire: its body beside its envelope."""
    body = message_type.model_json_schema()
    envelope = Envelope.model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": schema_of(message_type),
        "title": message_type.__name__,
        "description": body["description"],
        "type": "object",
        "properties": {
            "schema": {"const": schema_of(message_type)},
            **envelope["properties"],
            **body["properties"],
        },
        "required": ["schema", *envelope["required"], *body.get("required", ())],
        "$defs": {**envelope.get("$defs", {}), **body.get("$defs", {})},
    }


def contract_files() -> dict[str, bytes]:
    """Return the content of every file of the contract, by its path in the contract's folder."""
    return dict(_contract_files())


def write_contract(folder: Path) -> list[str]:
    """Bring the contract in `folder` up to date; return the paths that would need a new version."""
    drifted = drifted_files(folder)
    for path, content in contract_files().items():
        if path not in drifted:
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
    return drifted


def drifted_files(folder: Path) -> list[str]:
    """Return the paths in `folder` that say something else than the code does, words aside."""
    return [
        path
        for path, content in contract_files().items()
        if (folder / path).is_file()
        and _without_words(path, (folder / path).read_bytes()) != _without_words(path, content)
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Write the contract; return 1 where a message changed without a new version."""
    parser = argparse.ArgumentParser(prog="python -m hmcs.bus.schemas", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR")
    drifted = write_contract(parser.parse_args(argv).folder)
    if drifted:
        sys.stderr.write(
            f"changed without a new version: {', '.join(drifted)}. Raise VERSION of those messages "
            "in hmcs/bus/messages.py; where no peer has that version yet, delete the files instead "
            "and run this again\n"
        )
    return 1 if drifted else 0


def _contract_files() -> Iterator[tuple[str, bytes]]:
    examples = {type(example): example for example in EXAMPLES}
    for message_type in MESSAGES:
        name = schema_of(message_type).replace("/", "-")
        data = encode(examples[message_type], ENVELOPE)
        yield f"schemas/{name}.json", _json(wire_schema(message_type))
        yield f"golden/{name}.bin", data
        yield f"golden/{name}.json", _json(_readable(msgpack.unpackb(data)))


def _readable(value: Any) -> Any:
    if isinstance(value, dict):
        if isinstance(value.get("data"), bytes):
            numbers = np.frombuffer(value["data"], value["dtype"]).reshape(value["shape"])
            return {"dtype": value["dtype"], "shape": value["shape"], "data": numbers.tolist()}
        return {name: _readable(part) for name, part in value.items()}
    if isinstance(value, bytes):
        return {"base64": base64.b64encode(value).decode()}
    if isinstance(value, list):
        return [_readable(part) for part in value]
    return value


def _without_words(path: str, content: bytes) -> object:
    return _stripped(json.loads(content)) if path.startswith("schemas/") else content


def _stripped(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_stripped(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    # A field may be called `description`; words are strings, fields are schemas.
    return {
        name: _stripped(part)
        for name, part in schema.items()
        if not (name in _WORDS and isinstance(part, str))
    }


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=2, ensure_ascii=False) + "\n").encode()


if __name__ == "__main__":
    raise SystemExit(main())
