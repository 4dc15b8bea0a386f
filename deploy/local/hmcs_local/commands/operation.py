"""What an operator moves and stops the robot with: `devices`, `play`, `stop`."""

from __future__ import annotations

import typer

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs_local.commands.options import Cell, Router, Secure
from hmcs_local.commands.replies import tell_replies
from hmcs_local.tables import screen


def devices() -> None:
    """List input devices: which are here, which are missing, and what to do about it.

    The exit code is 0 where one is ready, else 1.
    """
    from hmcs_local.devices import show_devices

    raise typer.Exit(0 if show_devices(screen()) else 1)


def stop(router: Router = DEFAULT_ROUTER, cell: Cell = "demo", secure: Secure = None) -> None:
    """Let every robot stand, until its operator lets go and takes hold again.

    An operator that is played or simulated waits for `hmcs play`. All robots are asked at once. The
    exit code is 0 where every one that is present says that it stands, else 1.
    """
    from hmcs_local.asking import stop_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = stop_everybody(bus)
    raise typer.Exit(tell_replies(replies))


def play(router: Router = DEFAULT_ROUTER, cell: Cell = "demo", secure: Secure = None) -> None:
    """Let an operator that is played or simulated begin, or go on where it let go for a stop.

    The exit code is 0 where every input device has done it, else 1.
    """
    from hmcs.bus.messages import Ask
    from hmcs.bus.verbs import PLAY
    from hmcs_local.asking import ask_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = ask_everybody(bus, PLAY, Ask())
    raise typer.Exit(tell_replies(replies))
