"""What is kept with a recording besides its messages: who is there, their settings and models, and
how their robots look."""

from __future__ import annotations

import importlib.metadata
import json
import logging
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from hmcs.bus.keys import ANY
from hmcs.bus.messages import Ask, Description, Message, RobotLooks, SettingsReport
from hmcs.bus.session import Answer, Bus, StoppedError
from hmcs.recordings.parts import Preface, as_fields
from hmcs.recordings.reading import LARGEST_ATTACHMENT_BYTES

M = TypeVar("M", bound=Message)

ASK_S = 0.5
JOINTS = "joints/"
"""Metadata of this beginning and a robot's name say what its description calls its joints."""


def preface_of(bus: Bus, models: Sequence[Path], log: logging.Logger) -> Preface:
    """Return who is there, what they are told to do, and the models they work with."""
    members = {
        f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body
        for answer in answers(bus, ANY, "describe", Description)
    }
    settings = {
        f"{answer.envelope.source.service}/{answer.envelope.source.instance}": answer.body.settings
        for answer in answers(bus, ANY, "settings", SettingsReport)
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


def looks_of(bus: Bus) -> dict[str, RobotLooks]:
    """Return how the robots look that are there now and say so, by their names."""
    return {answer.body.robot: answer.body for answer in answers(bus, "robot", "looks", RobotLooks)}


def looks_kept(looks: RobotLooks) -> Preface:
    """Return what is kept of how a robot looks: its description, and its joints' names in order."""
    urdf = f"{looks.robot}.urdf"
    facts = {"joints": " ".join(looks.joints), "description": urdf}
    return Preface({f"{JOINTS}{looks.robot}": facts}, {urdf: looks.urdf.encode()})


def looks_unknown(robot: str) -> Preface:
    """Return what is kept of a robot that does not say how it looks."""
    facts = {"joints": "", "unknown": "it gives no answer to `looks`: its joints cannot be shown"}
    return Preface({f"{JOINTS}{robot}": facts}, {})


def answers(bus: Bus, service: str, verb: str, answer_type: type[M]) -> list[Answer[M]]:
    """Return what all that are there answer; nothing once this process is to end."""
    try:
        return bus.ask(bus.keys.rpc(service, ANY, verb), Ask(), answer_type, ASK_S)
    except StoppedError:
        return []


def _kept(places: Sequence[Path], log: logging.Logger) -> Iterator[tuple[str, bytes]]:
    """Model files by names that are told apart; one that cannot be read is told and left out."""
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
