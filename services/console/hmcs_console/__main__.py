"""Run the service: `python -m hmcs_console`."""

from hmcs.bus.service import run
from hmcs_console.service import Console

if __name__ == "__main__":
    raise SystemExit(run(Console))
