"""How much memory work takes at most, measured in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

_STATUS = Path("/proc/self/status")
_MEASURED = """
import sys
{preparation}
def peak_kb():
    # What `resource` tells begins with the peak of the process that started this one.
    lines = open("/proc/self/status").read().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1])
before_kb = peak_kb()
{work}
print(peak_kb() - before_kb)
"""


def grown_mb(preparation: str, work: str, *arguments: object) -> float:
    """Return by how much the peak memory of a process grows by `work`, after `preparation`, MB.

    Both are source text; `sys.argv` holds the arguments.
    """
    if not _STATUS.exists():
        pytest.skip("only Linux reports the peak memory of a process")
    done = subprocess.run(
        [sys.executable, "-c", _MEASURED.format(preparation=preparation, work=work)]
        + [str(each) for each in arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MALLOC_ARENA_MAX": "1"},
    )
    assert done.returncode == 0, done.stderr
    return int(done.stdout.splitlines()[-1]) / 1024
