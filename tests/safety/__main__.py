"""`python -m safety NAME`: one campaign against the stack, printed with its goals."""

from __future__ import annotations

import argparse

from rich.progress import Progress

from bench.figures import Figure, tell
from safety import control_gap, faults, memory, regions, ros2, tls_hop


def main() -> int:
    """Run one campaign; return 1 where a goal was missed."""
    parser = argparse.ArgumentParser(prog="python -m safety", description=__doc__)
    names = parser.add_subparsers(dest="name", required=True)
    for name, module in (("regions", regions), ("faults", faults)):
        chosen = names.add_parser(name, help=module.__doc__)
        chosen.add_argument("--trials", type=int, default=200 if name == "regions" else 1000)
        chosen.add_argument("--seed", type=int, default=1)
        if name == "faults":
            chosen.add_argument("--hogs", type=int, default=0, help="busy loops beside it")
    chosen = names.add_parser("gap", help=control_gap.__doc__)
    chosen.add_argument("--flood-s", type=float, default=10.0)
    chosen = names.add_parser("tls", help=tls_hop.__doc__)
    chosen.add_argument("--span-s", type=float, default=60.0)
    chosen = names.add_parser("memory", help=memory.__doc__)
    chosen.add_argument("--minutes", type=float, default=10.0)
    chosen = names.add_parser("ros2", help=ros2.__doc__)
    chosen.add_argument("--minutes", type=float, default=10.0)
    with Progress() as progress:
        figures, title = _measured(parser.parse_args(), progress)
    return 0 if tell(title, figures) else 1


def _measured(chosen: argparse.Namespace, progress: Progress) -> tuple[list[Figure], str]:
    match chosen.name:
        case "regions":
            return regions.measure(chosen.trials, chosen.seed, progress), str(regions.__doc__)
        case "faults":
            measured = faults.measure(chosen.trials, chosen.seed, chosen.hogs, progress)
            return measured, str(faults.__doc__)
        case "gap":
            return control_gap.measure(chosen.flood_s, progress), str(control_gap.__doc__)
        case "tls":
            return tls_hop.measure(chosen.span_s, progress), str(tls_hop.__doc__)
        case "ros2":
            return ros2.measure(chosen.minutes, progress), str(ros2.__doc__)
        case _:
            return memory.measure(chosen.minutes, progress), str(memory.__doc__)


if __name__ == "__main__":
    raise SystemExit(main())
