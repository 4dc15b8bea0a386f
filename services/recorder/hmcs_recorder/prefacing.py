"""What is kept with a recording besides its messages: who is there, their settings and models."""

from __future__ import annotations

import importlib.metadata
import json
import logging
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from hmcs.bus.messages import Ask, Message
from hmcs.bus.session import Answer, Bus, StoppedError
from hmcs.bus.verbs import DESCRIBE, SETTINGS, Verb
from hmcs.recordings.file_rotation import Preface, as_fields
from hmcs.recordings.reading import LARGEST_ATTACHMENT_BYTES

Q = TypeVar("Q", bound=Message)
A = TypeVar("A", bound=Message)

ASK_S = 0.5


def preface_of(bus: Bus, models: Sequence[Path], log: logging.Logger) -> Preface:
    """Return who is there, their settings, and the models they work with."""
    members = {
        f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body
        for answer in ask_all(bus, DESCRIBE, Ask())
    }
    settings = {
        f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body.settings
        for answer in ask_all(bus, SETTINGS, Ask())
    }
    metadata = {
        "hmcs": as_fields(
            {
                "version": importlib.metadata.version("hmcs"),
                "cell": bus.settings.cell,
                "begun": datetime.now(UTC).isoformat(),
            }
        )
    }
    for member, description in members.items():
        facts = {"version": description.version, **description.facts}
        if member in settings:
            facts["settings"] = json.dumps(settings[member])
        metadata[member] = as_fields(facts)
    return Preface(metadata, dict(_kept(models, log)))


def joined(*prefaces: Preface) -> Preface:
    """Return all of several prefaces as one."""
    return Preface(
        {name: facts for each in prefaces for name, facts in each.metadata.items()},
        {name: content for each in prefaces for name, content in each.attachments.items()},
    )


def ask_all(bus: Bus, verb: Verb[Q, A], question: Q) -> list[Answer[A]]:
    """Return what all that are there answer; nothing once this process is to end."""
    try:
        return verb.ask(bus, question, timeout_s=ASK_S)
    except StoppedError:
        return []


def _kept(places: Sequence[Path], log: logging.Logger) -> Iterator[tuple[str, bytes]]:
    """Model files, each under a name of its own; one that cannot be read is logged, left out."""
    taken: set[str] = set()
    for file in _files(places):
        try:
            size = file.stat().st_size
            if size > LARGEST_ATTACHMENT_BYTES:
                raise OSError(f"it has {size / 1e6:.0f} MB, more than is read again")
            content = file.read_bytes()
        except OSError as error:
            log.warning("a model is not kept", extra={"file": str(file), "reason": str(error)})
            continue
        name, number = file.name, 1
        while name in taken:
            number += 1
            name = f"{file.stem}-{number}{file.suffix}"
        taken.add(name)
        yield name, content


def _files(places: Sequence[Path]) -> list[Path]:
    found: list[Path] = []
    for place in places:
        found += sorted(place.glob("*.hmcs")) if place.is_dir() else [place]
    return [file for file in found if file.is_file()]
