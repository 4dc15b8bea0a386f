"""How it travels: one profile a message, with its reason.

No profile is *express with drop*: where several publishers share a link, express sends each message
in a batch of its own, the queue overruns, and with drop up to a third of the messages are lost.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from hmcs.bus.messages import (
    Belief,
    Command,
    Evidence,
    FixtureState,
    Handle,
    Label,
    Message,
    Motion,
    Pairing,
    RobotState,
    Step,
    StopRequest,
    TrainingProgress,
)

Priority = Literal["real_time", "interactive_high", "data_high", "data", "data_low"]


class QosProfile(NamedTuple):
    """How messages of one kind travel."""

    priority: Priority
    congestion: Literal["drop", "block"]
    """What a full queue does: drop loses this message, block holds the sender up."""
    reliability: Literal["reliable", "best_effort"]
    delivery: Literal["keep_last", "keep_all"]
    """What a slow receiver gets: the newest message only, or every one in order."""
    reason: str


QOS_PROFILES: dict[type[Message], QosProfile] = {
    Motion: QosProfile(
        "real_time", "drop", "reliable", "keep_last",
        "The hand as it is now; an old sample is worth nothing once a newer one is there.",
    ),
    Command: QosProfile(
        "real_time", "drop", "reliable", "keep_last",
        "The robot follows the newest reference; catching up on old ones would be wrong.",
    ),
    Step: QosProfile(
        "interactive_high", "drop", "reliable", "keep_all",
        "The classifiers' clock: each step counts; a lost one is seen in its index and asked for.",
    ),
    Evidence: QosProfile(
        "interactive_high", "drop", "reliable", "keep_all",
        "Each step's evidence moves the filter; blocking one classifier must not hold the others.",
    ),
    Belief: QosProfile(
        "interactive_high", "drop", "reliable", "keep_all",
        "Few and small; observers score every step, and the fixture looks at the last one anyway.",
    ),
    FixtureState: QosProfile(
        "data", "drop", "reliable", "keep_all",
        "For observers and recorders; behind whatever moves the robot.",
    ),
    Pairing: QosProfile(
        "interactive_high", "drop", "reliable", "keep_last",
        "Who drives whom as it is now; it is said again a few times a second.",
    ),
    StopRequest: QosProfile(
        "real_time", "drop", "reliable", "keep_all",
        "A stop goes before everything else, and each one is heard.",
    ),
    RobotState: QosProfile(
        "data_high", "drop", "reliable", "keep_last",
        "The fixture wants the pose as it is now; only what moves the robot goes first.",
    ),
    Handle: QosProfile(
        "interactive_high", "drop", "reliable", "keep_last",
        "The handle as it is now; a page is no real-time device, and goes behind those.",
    ),
    Label: QosProfile(
        "data_high", "drop", "reliable", "keep_all",
        "Rare and said once by a person: each is to be written down, in order.",
    ),
    TrainingProgress: QosProfile(
        "data_low", "drop", "reliable", "keep_all",
        "For people who watch a training; behind everything that moves or is recorded.",
    ),
}  # fmt: skip
"""The profile of every published message; questions and answers travel by Zenoh's queries."""


def profile_of(message_type: type[Message]) -> QosProfile:
    """Return how a message travels; raises ValueError for one that is not published."""
    try:
        return QOS_PROFILES[message_type]
    except KeyError:
        raise ValueError(
            f"{message_type.__name__} is not published: it has no profile in hmcs.bus.qos "
            f"(those that have: {', '.join(sorted(m.__name__ for m in QOS_PROFILES))})"
        ) from None
