"""Trains once and ends, with the CLI of `hmcs train`; or, as `serve`, waits for requests."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from hmcs.bus.service import run
from hmcs.errors import UserError
from hmcs.recognition.registry import DEFAULT
from hmcs.task import load_task
from hmcs_trainer.performance import perform
from hmcs_trainer.service import Trainer
from hmcs_trainer.training import train


def main(argv: Sequence[str] | None = None) -> int:
    """Run with these arguments; return the exit code, 2 for a mistake of the user."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] == ["serve"]:
        return run(Trainer, words[1:])
    parser = argparse.ArgumentParser(prog="hmcs_trainer", description=__doc__)
    parser.add_argument("task", help="name of a shipped task or a task file")
    parser.add_argument(
        "demonstrations",
        nargs="+",
        help="CSV files, recordings, lasa:SHAPE/NUMBER or lasa:SHAPE/FIRST-LAST",
    )
    parser.add_argument("--output", required=True, help="the model file to write")
    parser.add_argument("--name", help="of the recognizer; the task's name by default")
    parser.add_argument(
        "--performance", nargs="+", default=[], help="demonstrations to chain for the input device"
    )
    parser.add_argument("--performance-output", help="the CSV file to write them to")
    parser.add_argument(
        "--ring", action="store_true", help="bend the performance to end where it began"
    )
    parser.add_argument("--recognizer", default=DEFAULT, help="the kind to learn for")
    parser.add_argument(
        "--find-states", action="store_true", help="find states in the motion, without labels"
    )
    parser.add_argument(
        "--accept-implausible",
        action="store_true",
        help="learn even from what no hand seems to have made: jumps, other units",
    )
    parser.add_argument("--report", help="the page to write on what the model is worth")
    parser.add_argument(
        "--stack-task",
        metavar="TASK",
        help="the task that a stack is brought up for: where it is another one, nothing is learned",
    )
    given = parser.parse_args(words)
    if given.stack_task not in (None, given.task):
        print(f"nothing to learn: the stack is for {given.stack_task}", file=sys.stderr)
        return 0
    if bool(given.performance) != bool(given.performance_output):
        parser.error("--performance and --performance-output go together")
    try:
        model = train(
            given.task,
            given.demonstrations,
            given.output,
            name=given.name,
            recognizer=given.recognizer,
            find_states=given.find_states,
            report=given.report,
            accept_implausible=given.accept_implausible,
            progress=lambda line: print(line, file=sys.stderr),
        )
        if given.performance:
            perform(
                load_task(given.task), given.performance, given.performance_output, ring=given.ring
            )
    except UserError as error:
        print(f"hmcs_trainer: {error}", file=sys.stderr)
        return 2
    print(f"{given.output}: {model.name}, {len(model.gesteme_names)} gestemes, hash {model.hash}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
