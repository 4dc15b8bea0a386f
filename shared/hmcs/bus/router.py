"""The router: a Zenoh session of this process that passes everybody's messages on.

`python -m hmcs.bus.router [--listen ENDPOINT] [--config FILE]` is one as a process of its own; it
says on stdout that it is ready and ends with code 0 at SIGTERM or SIGINT. It listens on this
machine alone unless it is started with `--open-to-network`, or with HMCS_OPEN_TO_NETWORK=true.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import zenoh

from hmcs.bus.config import (
    ACCEPTING_AT_ONCE,
    DEFAULT_ROUTER,
    OPEN_TO_NETWORK,
    check_endpoint,
    opens_to_network,
    router_config,
)
from hmcs.errors import UserError

_FILES_OF_ONE_PROCESS = 2048
"""Descriptors for sessions, logs and whatever else a router's process has open."""


class RouterError(UserError):
    """A router that could not be started."""


def open_router(
    listen: str | None = None, config: Path | None = None, *, open_to_network: bool = False
) -> zenoh.Session:
    """Start a router that listens on `listen`, e.g. `tcp/127.0.0.1:7447`, until it is closed.

    `config` is a Zenoh json5 file such as `deploy/router/router.json5`; `listen` overrides the
    endpoints it names. With neither, the router listens where processes look by default.
    The session must be closed: use `with`. Now and then a client slips back in while it closes and
    then stays with it as long as this process lives, deaf to a router opened later: a router that
    is to be restarted needs a process of its own.
    Raises RouterError where the endpoint is taken or the file is no configuration; and for an
    endpoint that other hosts reach without TLS, unless `open_to_network`: everybody who reaches it
    can move the robot.
    """
    try:
        settings = router_config() if config is None else zenoh.Config.from_file(config)
        if listen is not None:
            settings.insert_json5("listen/endpoints", json.dumps([check_endpoint(listen)]))
        settings.insert_json5("mode", json.dumps("router"))
        settings.insert_json5("listen/exit_on_failure", "true")
    except (ValueError, OSError, zenoh.ZError) as error:
        where = "" if config is None else f"{config}: "
        raise RouterError(f"router: {where}{_short(error)}") from error
    if not open_to_network:
        _check_kept_local(settings)
    _allow_open_files(ACCEPTING_AT_ONCE + _FILES_OF_ONE_PROCESS)
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
    parser.add_argument(
        "--open-to-network",
        action="store_true",
        default=os.environ.get("HMCS_OPEN_TO_NETWORK", "").lower() in ("1", "true", "yes", "on"),
        help="listen beyond this machine without TLS: everybody who reaches the port can move the "
        "robot",
    )
    arguments = parser.parse_args(argv)
    ends = {signal.SIGTERM, signal.SIGINT}
    # Blocked before Zenoh starts its threads, so that sigwait below is the one to get them.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    try:
        with open_router(
            arguments.listen, arguments.config, open_to_network=arguments.open_to_network
        ):
            print("router: ready", flush=True)
            signal.sigwait(ends)
    except RouterError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return 0


def _check_kept_local(settings: zenoh.Config) -> None:
    listening = json.loads(settings.get_json("listen/endpoints"))
    if isinstance(listening, dict):
        listening = listening.get("router", [])
    for endpoint in listening:
        if opens_to_network(str(endpoint)):
            raise RouterError(
                f"router: {endpoint} can be reached from other hosts without TLS: everybody who "
                f"reaches it can move the robot. Listen on {DEFAULT_ROUTER} or on tls/…, or say "
                f"that you mean it: {OPEN_TO_NETWORK}"
            )


def _allow_open_files(count: int) -> None:
    """Let this process have so many files open, as far as it may: each connection is one."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = count if hard == resource.RLIM_INFINITY else min(count, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def _short(error: Exception) -> str:
    return str(error).split(" at /")[0]


if __name__ == "__main__":
    raise SystemExit(main())
