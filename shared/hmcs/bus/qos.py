"""How it travels: one stance a message, with its reason.

No stance is *express with drop*: where several publishers share a link, express sends each message
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


class Stance(NamedTuple):
    """How messages of one kind travel."""

    priority: Priority
    congestion: Literal["drop", "block"]
    """What a full queue does: drop loses this message, block holds the sender up."""
    reliability: Literal["reliable", "best_effort"]
    delivery: Literal["newest_wins", "every_one"]
    """What a slow receiver gets: the newest message only, or every one in order."""
    reason: str


STANCES: dict[type[Message], Stance] = {
    Motion: Stance(
        "real_time", "drop", "reliable", "newest_wins",
        "The hand as it is now; an old sample is worth nothing once a newer one is there.",
    ),
    Command: Stance(
        "real_time", "drop", "reliable", "newest_wins",
        "The robot follows the newest reference; catching up on old ones would be wrong.",
    ),
    Step: Stance(
        "interactive_high", "drop", "reliable", "every_one",
        "The classifiers' clock: each step counts; a lost one is seen in its index and asked for.",
    ),
    Evidence: Stance(
        "interactive_high", "drop", "reliable", "every_one",
        "Each step's evidence moves the filter; blocking one classifier must not hold the others.",
    ),
    Belief: Stance(
        "interactive_high", "drop", "reliable", "every_one",
        "Few and small; observers score every step, and the fixture looks at the last one anyway.",
    ),
    FixtureState: Stance(
        "data", "drop", "reliable", "every_one",
        "For observers and recorders; behind whatever moves the robot.",
    ),
    Pairing: Stance(
        "interactive_high", "drop", "reliable", "newest_wins",
        "Who drives whom as it is now; it is said again a few times a second.",
    ),
    StopRequest: Stance(
        "real_time", "drop", "reliable", "every_one",
        "A stop goes before everything else, and each one is heard.",
    ),
    RobotState: Stance(
        "data_high", "drop", "reliable", "newest_wins",
        "The fixture wants the pose as it is now; only what moves the robot goes first.",
    ),
    Handle: Stance(
        "interactive_high", "drop", "reliable", "newest_wins",
        "The handle as it is now; a page is no real-time device, and goes behind those.",
    ),
    Label: Stance(
        "data_high", "drop", "reliable", "every_one",
        "Rare and said once by a person: each is to be written down, in order.",
    ),
    TrainingProgress: Stance(
        "data_low", "drop", "reliable", "every_one",
        "For people who watch a training; behind everything that moves or is recorded.",
    ),
}  # fmt: skip
"""The stance of every published message; questions and answers travel by Zenoh's queries."""
