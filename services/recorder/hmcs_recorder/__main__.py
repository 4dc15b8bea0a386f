"""Run the service: `python -m hmcs_recorder`."""

from hmcs.bus.service import run
from hmcs_recorder.service import Recorder

if __name__ == "__main__":
    raise SystemExit(run(Recorder))
