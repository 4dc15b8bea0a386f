"""What every process answers: questions without arguments, health, description, settings."""

from __future__ import annotations

from typing import Any

from hmcs.bus.messages.fields import Real
from hmcs.bus.messages.message import Message


class Ask(Message):
    """A question without arguments (`health`, `describe`, `settings`)."""

    SCHEMA = "ask"


class Done(Message):
    """The answer to a request that was carried out."""

    SCHEMA = "done"

    detail: str
    """One line: what is so now."""


class Refusal(Message):
    """The answer to a question that could not be answered."""

    SCHEMA = "refusal"

    reason: str
    """What was wrong, what was expected, what to do."""


class Health(Message):
    """How a process is."""

    SCHEMA = "health"

    healthy: bool
    """True when it does what it is for."""
    detail: str
    """One line: what it does, or what it waits for."""
    uptime_s: Real
    """Since the process started."""
    loop_rate_hz: Real
    """Messages and timers handled per second, over the last second."""
    cpu_s: Real
    """Processor time used since the process started."""
    received: dict[str, int]
    """Messages received, per schema."""
    sent: dict[str, int]
    """Messages sent, per schema."""
    lost: dict[str, int]
    """Messages missing in the sequence numbers of their sources, per schema."""
    refused: dict[str, int]
    """Messages refused (malformed, unknown schema or version, another model's), per schema."""
    late: dict[str, int]
    """Messages that came too late to be used, per schema."""


class Description(Message):
    """What a process is."""

    SCHEMA = "description"

    version: str
    """Of the software."""
    publishes: tuple[str, ...]
    """Key expressions."""
    subscribes: tuple[str, ...]
    """Key expressions."""
    answers: tuple[str, ...]
    """Key expressions."""
    facts: dict[str, str]
    """What else is worth knowing, e.g. `model`, `model_hash`, `gestemes`, `active_model`."""


class SettingsReport(Message):
    """The settings in force."""

    SCHEMA = "settings_report"

    settings: dict[str, Any]
    """Field name to value, as in the service's settings file."""
