"""Install uv, at the version and with the hashes of uv.lock, into the environment of this Python.

Used by the Makefile and by deploy/Dockerfile, so that both stand on the locked uv and no other.
Does nothing where that version is installed already. Standard library only, of any Python 3.8 or
later: what downloads CPython 3.11 begins with it, see find_python.sh.
"""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
import tempfile
from pathlib import Path

LOCK = Path(__file__).parent.parent / "uv.lock"


def main() -> int:
    """Install uv; return pip's exit code."""
    version, hashes = locked_uv(LOCK.read_text(encoding="utf-8"))
    try:
        if importlib.metadata.version("uv") == version:
            return 0
    except importlib.metadata.PackageNotFoundError:
        pass
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    with tempfile.TemporaryDirectory() as folder:
        requirements = Path(folder) / "uv.txt"
        hashed = " ".join(f"--hash={each}" for each in hashes)
        requirements.write_text(f"uv=={version} {hashed}\n", encoding="utf-8")
        options = ["--require-hashes", "--only-binary=:all:", "--no-deps", "-r", str(requirements)]
        return subprocess.run([*pip, *options], check=False).returncode


def locked_uv(lock: str) -> tuple[str, list[str]]:
    """Return the version of uv in a lock file, and the hashes of its wheels.

    Not by tomllib, which came with Python 3.11.
    """
    uv = next(part for part in lock.split("[[package]]") if part.startswith('\nname = "uv"\n'))
    version = re.search(r'^version = "(.+)"$', uv, re.M).group(1)
    wheels = uv[uv.index("\nwheels = [") :]
    return version, re.findall(r'hash = "(sha256:[0-9a-f]+)"', wheels)


if __name__ == "__main__":
    raise SystemExit(main())
