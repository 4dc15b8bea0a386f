"""Runs any registered recognizer."""

from hmcs.bus.service import run
from hmcs_recognizer.service import RecognizerService

if __name__ == "__main__":
    raise SystemExit(run(RecognizerService))
