"""Runs the laboratory's command line."""

from __future__ import annotations


def _run() -> int:
    try:
        # Here, since what it imports takes seconds in which Ctrl-C may come too.
        from hmcs_laboratory.command import main

        return main()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    raise SystemExit(_run())
