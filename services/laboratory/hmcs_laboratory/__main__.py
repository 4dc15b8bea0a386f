"""Runs the laboratory's command line."""

from hmcs_laboratory.command import main

if __name__ == "__main__":
    raise SystemExit(main())
