"""Run the service: `python -m hmcs_console`."""

import gc

from hmcs.bus.service import run
from hmcs_console.service import Console

if __name__ == "__main__":
    # What the libraries have loaded stays. Looking through all of it for garbage holds up every
    # thread at once, up to 0.2 s on a busy machine: longer than a held handle may be silent.
    gc.freeze()
    raise SystemExit(run(Console))
