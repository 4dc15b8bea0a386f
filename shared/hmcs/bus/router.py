"""The router: a Zenoh session of this process that passes everybody's messages on.

`python -m hmcs.bus.router [--listen ENDPOINT] [--config FILE]` is one as a process of its own; it
says on stdout that it is ready and ends with code 0 at SIGTERM or SIGINT.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import zenoh

from hmcs.bus.config import DEFAULT_ROUTER, check_endpoint, router_config
from hmcs.errors import UserError


class RouterError(UserError):
    """A router that could not be started."""


def open_router(listen: str | None = None, config: Path | None = None) -> zenoh.Session:
    """Start a router that listens on `listen`, e.g. `tcp/127.0.0.1:7447`, until it is closed.

    `config` is a Zenoh json5 file such as `deploy/router/router.json5`; `listen` overrides the
    endpoints it names. With neither, the router listens where processes look by default.
    The session must be closed: use `with`. Now and then a client slips back in while it closes and
    then stays with it as long as this process lives, deaf to a router opened later: a router that
    is to be restarted needs a process of its own.
    Raises RouterError where the endpoint is taken or the file is no configuration.
    """
    try:
        settings = router_config() if config is None else zenoh.Config.from_file(config)
        if listen is None and config is None:
            listen = DEFAULT_ROUTER
        if listen is not None:
            settings.insert_json5("listen/endpoints", json.dumps([check_endpoint(listen)]))
        settings.insert_json5("mode", json.dumps("router"))
        settings.insert_json5("listen/exit_on_failure", "true")
    except (ValueError, OSError, zenoh.ZError) as error:
        where = "" if config is None else f"{config}: "
        raise RouterError(f"router: {where}{_short(error)}") from error
    try:
        return zenoh.open(settings)
    except zenoh.ZError as error:
        endpoint = settings.get_json("listen/endpoints")
        if "in use" in str(error):
            raise RouterError(
                f"router: {endpoint} is taken, perhaps by another router: there cannot be two on "
                "one port. Use that one, stop it, or listen on another port"
            ) from error
        raise RouterError(f"router: cannot listen on {endpoint}: {_short(error)}") from error


def main(argv: Sequence[str] | None = None) -> int:
    """Be a router until SIGTERM or SIGINT; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m hmcs.bus.router", description=__doc__, allow_abbrev=False
    )
    parser.add_argument("--listen", metavar="ENDPOINT", help=f"e.g. {DEFAULT_ROUTER}")
    parser.add_argument("--config", type=Path, metavar="FILE", help="Zenoh json5 file")
    arguments = parser.parse_args(argv)
    ends = {signal.SIGTERM, signal.SIGINT}
    # Blocked before Zenoh starts its threads, so that sigwait below is the one to get them.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    try:
        with open_router(arguments.listen, arguments.config):
            print("router: ready", flush=True)
            signal.sigwait(ends)
    except RouterError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return 0


def _short(error: Exception) -> str:
    return str(error).split(" at /")[0]


if __name__ == "__main__":
    raise SystemExit(main())
