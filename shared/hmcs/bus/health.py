"""Ask a service how it is: `python -m hmcs.bus.health --service task_hmm`.

Exits with 0 where it answers that it is healthy, with 1 and one line why otherwise, with 2 for a
mistake in the question. Router, cell and instance are taken from HMCS_ROUTER, HMCS_CELL and
HMCS_INSTANCE unless given, certificates from HMCS_TLS_CA, HMCS_TLS_CERTIFICATE and HMCS_TLS_KEY;
without an instance every one of the service that is present must answer and be healthy. The service
`router` is the router itself: it is healthy when a session with it opens.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Sequence
from operator import itemgetter

from pydantic import ValidationError

from hmcs.bus.config import DEFAULT_ROUTER, tls_files
from hmcs.bus.keys import ANY, KeyNameError, Member
from hmcs.bus.messages import Ask, Health
from hmcs.bus.session import Answer, Bus, BusSettings, BusUnavailableError, RequestRefusedError
from hmcs.bus.verbs import HEALTH
from hmcs.shown import plain

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
        router=arguments.router,
        cell=arguments.cell,
        connect_timeout_s=arguments.timeout,
        **tls_files(os.environ),
    )
    quiet = logging.Logger("health")
    quiet.addHandler(logging.NullHandler())
    try:
        with Bus.open(settings, "health", f"pid-{os.getpid()}", log=quiet) as bus:
            if arguments.service == ROUTER:
                return None
            keys = bus.keys
            asked = Member(arguments.service, arguments.instance)
            there = bus.present(keys.presence(*asked)).members
            answers = HEALTH.ask(
                bus,
                Ask(),
                service=asked.service,
                instance=asked.instance,
                timeout_s=arguments.timeout,
            )
    except BusUnavailableError as error:
        return str(error)
    except RequestRefusedError as error:
        return f"could not say how it is: {error}"
    within = f"within {arguments.timeout:g} s (router {settings.router})"
    healths = {
        member: answer.body
        for answer in answers
        if (member := _sender(answer)).service == arguments.service
    }
    problems = [
        *(
            f"{member.instance}: is present, but did not answer {within}"
            for member in there
            if member not in healths
        ),
        *(
            f"{member.instance}: {plain(health.detail)}"
            for member, health in sorted(healths.items(), key=itemgetter(0))
            if not health.healthy
        ),
    ]
    if not healths and not problems:
        return f"nobody answered on {keys.rpc(*asked, HEALTH.name)} {within}"
    return "; ".join(problems) or None


def _sender(answer: Answer[Health]) -> Member:
    return Member(answer.envelope.source.service, answer.envelope.source.instance)


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
