"""Runs a task HMM."""

from hmcs.bus.service import run
from hmcs_task_hmm.service import TaskFilterService

if __name__ == "__main__":
    raise SystemExit(run(TaskFilterService))
