"""Ask a service how it is: `python -m hmcs.bus.health --service task_hmm`.

Exits with 0 where it answers that it is healthy, with 1 and one line why otherwise, with 2 for a
mistake in the question. Router, cell and instance are taken from HMCS_ROUTER, HMCS_CELL and
HMCS_INSTANCE unless given; without an instance every one of the service must be healthy. The
service `router` is the router itself: it is healthy when a session with it opens.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Sequence

from pydantic import ValidationError

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.bus.keys import ANY, KeyNameError
from hmcs.bus.messages import Ask, Health
from hmcs.bus.session import Bus, BusSettings, BusUnavailableError, RequestRefusedError

ROUTER = "router"


def main(argv: Sequence[str] | None = None) -> int:
    """Ask; return the exit code."""
    arguments = _parser().parse_args(argv)
    try:
        problem = _problem(arguments)
    except (ValidationError, KeyNameError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        sys.stderr.write(f"health: {reason}\n")
        return 2
    if problem:
        sys.stdout.write(f"{arguments.service}: {problem}\n")
        return 1
    return 0


def _problem(arguments: argparse.Namespace) -> str | None:
    settings = BusSettings(
        router=arguments.router, cell=arguments.cell, connect_timeout_s=arguments.timeout
    )
    quiet = logging.Logger("health")
    quiet.addHandler(logging.NullHandler())
    try:
        with Bus.open(settings, "health", f"pid-{os.getpid()}", log=quiet) as bus:
            if arguments.service == ROUTER:
                return None
            key = bus.keys.rpc(arguments.service, arguments.instance, "health")
            answers = bus.ask(key, Ask(), Health, arguments.timeout)
    except BusUnavailableError as error:
        return str(error)
    except RequestRefusedError as error:
        return f"could not say how it is: {error}"
    if not answers:
        return f"nobody answered on {key} within {arguments.timeout:g} s (router {settings.router})"
    return next(
        (f"{a.envelope.source.instance}: {a.body.detail}" for a in answers if not a.body.healthy),
        None,
    )


def _parser() -> argparse.ArgumentParser:
    environment = os.environ.get
    parser = argparse.ArgumentParser(prog="python -m hmcs.bus.health", description=__doc__)
    parser.add_argument("--service", required=True, help="kind of process, e.g. task_hmm")
    parser.add_argument("--instance", default=environment("HMCS_INSTANCE", ANY))
    parser.add_argument("--router", default=environment("HMCS_ROUTER", DEFAULT_ROUTER))
    parser.add_argument("--cell", default=environment("HMCS_CELL", "demo"))
    parser.add_argument("--timeout", type=float, default=1.0, metavar="SECONDS")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
