"""The contract as a page for people, made of the very models that are spoken.

`python -m hmcs.bus.contract_page FILE` writes it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hmcs.bus.keys import Keys
from hmcs.bus.messages import (
    MESSAGES,
    Belief,
    Command,
    Envelope,
    Evidence,
    FixtureState,
    Handle,
    Label,
    Message,
    Motion,
    Origin,
    Part,
    RobotState,
    Source,
    Step,
    TrainingProgress,
)
from hmcs.bus.qos import STANCES
from hmcs.bus.wire import schema_of

_HEAD = """# The contract

*Generated from `shared/hmcs/bus/messages.py`, `keys.py` and `qos.py` by `make schemas`; edit those.*

A message is one msgpack map: the fields of its body beside those of its envelope and `schema`, its
name and version. Arrays travel as maps `{"dtype": "<f8", "shape": [3], "data": bytes}`,
little-endian, in C order. Unknown fields are ignored on reading; missing, mistyped, misshapen or
non-finite ones are refused and counted. A change that breaks readers raises the version, and
`tests/contract/` holds the JSON Schema and golden bytes of every version there ever was.

SI units; frames are right-handed, x forward, z up; quaternions x y z w; twists and wrenches linear
part first; poses in the robot's base frame unless a field says otherwise; times in nanoseconds.
"""


def page() -> str:
    """Return the page, Markdown."""
    return "\n".join([_HEAD, *_keys(), *_envelope(), *_messages()]).rstrip() + "\n"


def _keys() -> Iterator[str]:
    keys = Keys("CELL")
    published: dict[type[Message], str] = {
        Motion: keys.motion,
        Handle: keys.handle,
        Label: keys.label,
        Step: keys.step,
        Evidence: keys.evidence("MODEL", "INSTANCE"),
        Belief: keys.belief("MODEL"),
        Command: keys.command,
        FixtureState: keys.fixture_state,
        RobotState: keys.robot_state,
        TrainingProgress: keys.training,
    }
    yield "## Where it travels\n"
    yield "| key | message | priority | a slow receiver gets | why |"
    yield "|---|---|---|---|---|"
    for message, key in published.items():
        stance = STANCES[message]
        delivery = "the newest" if stance.delivery == "newest_wins" else "every one, in order"
        yield (
            f"| `{_named(key)}` | [{message.__name__}](#{message.__name__.lower()}) | "
            f"{stance.priority} | {delivery} | {stance.reason} |"
        )
    yield ""
    yield f"- `{_named(keys.presence('SERVICE', 'INSTANCE'))}`: liveliness token of a process."
    yield (
        f"- `{_named(keys.member('MODEL', 'SERVICE', 'INSTANCE'))}`: liveliness token of a process "
        "that works for a model, has replayed the last steps and is ready."
    )
    yield (
        f"- `{_named(keys.rpc('SERVICE', 'INSTANCE', 'VERB'))}`: a question a process answers. All "
        "answer `health`, `describe` and `settings`; `input_device` answers `last_steps` and "
        "`play`; recognizers and the fixture controller `load_model`; the fixture controller "
        "`activate`; the robot `looks`; the recorder `record`; the trainer `train` and `cancel`."
    )
    yield ""


def _envelope() -> Iterator[str]:
    yield "## What every message carries\n"
    for part in (Envelope, Source, Origin):
        yield from _part(part)


def _messages() -> Iterator[str]:
    yield "## Messages\n"
    for message in MESSAGES:
        yield from _part(message, f" `{schema_of(message)}`")


def _part(part: type[Part], suffix: str = "") -> Iterator[str]:
    yield f"### {part.__name__}{suffix}\n"
    yield f"{_sentence(part.__doc__ or '')}\n"
    if part.model_fields:
        yield "| field | type | |"
        yield "|---|---|---|"
        for name, field in part.model_fields.items():
            optional = "" if field.is_required() else ", optional"
            yield (
                f"| `{name}` | {_type(field.annotation, field.metadata)}{optional} | "
                f"{_sentence(field.description or '')} |"
            )
        yield ""


def _type(annotation: Any, metadata: list[Any]) -> str:
    shape = next((rule.shape_text for rule in metadata if hasattr(rule, "shape_text")), None)
    if shape is not None:
        return f"array {shape}"
    text = getattr(annotation, "__name__", None) or str(annotation)
    if "[" in str(annotation) or "|" in str(annotation):
        text = str(annotation)
    text = re.sub(r"typing\.|hmcs\.bus\.messages\.|numpy\.|<class '([^']+)'>", r"\1", text)
    text = re.sub(r"Annotated\[ndarray\[.*?ArraySpec\(shape=(\([^)]*\)).*?\]", r"array \1", text)
    text = re.sub(r"Annotated\[(\w+),.*?\)\]\)?\]", r"\1", text)
    text = re.sub(r"Optional\[(.+)\]$", r"\1 or None", text)
    text = re.sub(r"\((\w+),\)", r"(\1)", text)
    return text.replace("|", "or").replace("NoneType", "None")


def _sentence(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _named(key: str) -> str:
    """The key with its variable chunks in braces."""
    return re.sub(r"\b(CELL|MODEL|SERVICE|INSTANCE|VERB)\b", lambda m: f"{{{m[1].lower()}}}", key)


def main(argv: list[str] | None = None) -> int:
    """Write the page."""
    (path,) = sys.argv[1:] if argv is None else argv
    Path(path).write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
