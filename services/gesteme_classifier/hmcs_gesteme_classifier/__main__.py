"""Runs a gesteme classifier."""

from hmcs.bus.service import run
from hmcs_gesteme_classifier.service import GestemeClassifier

if __name__ == "__main__":
    raise SystemExit(run(GestemeClassifier))
