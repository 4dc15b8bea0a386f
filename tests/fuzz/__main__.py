"""`python -m fuzz`: a million hostile messages and ten thousand questions at a stack."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from rich.progress import Progress

from fuzz.campaign import Besieged
from support.stack import Stack
from support.taught import taught


def main() -> int:
    """Run the campaign; return 1 where anything came to harm."""
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("--messages", type=int, default=1_000_000)
    parser.add_argument("--questions", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=Path, help="folder for the logs, which are kept then")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hmcs-fuzz-") as name, Progress() as progress:
        folder = Path(name)
        task = progress.add_task("hostile messages", total=arguments.messages)
        model, performance = taught(folder)
        with (
            Stack(arguments.logs or folder / "logs") as stack,
            Besieged(stack, folder, model, performance) as besieged,
        ):
            verdict = besieged.siege(
                arguments.messages,
                arguments.questions,
                arguments.seed,
                lambda done: progress.update(task, completed=done),
            )
    sys.stdout.write(
        f"{verdict.messages} messages, {verdict.questions} questions (seed {arguments.seed})\n"
        f"processes ended: {', '.join(verdict.ended) or 'none'}\n"
        f"processes that did not answer: {', '.join(verdict.silent) or 'none'}\n"
        f"tracebacks: {len(verdict.tracebacks)}\n"
        f"slowest answer to health: {verdict.slowest_answer_s:.2f} s\n"
    )
    for line in verdict.tracebacks[:20]:
        sys.stdout.write(f"  {line}\n")
    return 0 if verdict.clean else 1


if __name__ == "__main__":
    raise SystemExit(main())
