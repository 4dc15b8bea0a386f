"""Install uv, at the version and with the hashes of uv.lock, into the environment of this Python.

Used by the Makefile and by deploy/Dockerfile, so that both stand on the locked uv and no other.
Does nothing where that version is installed already. Standard library only.
"""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

LOCK = Path(__file__).parent.parent / "uv.lock"


def main() -> int:
    """Install uv; return pip's exit code."""
    packages = tomllib.loads(LOCK.read_text(encoding="utf-8"))["package"]
    uv = next(package for package in packages if package["name"] == "uv")
    try:
        if importlib.metadata.version("uv") == uv["version"]:
            return 0
    except importlib.metadata.PackageNotFoundError:
        pass
    hashes = [f"--hash={wheel['hash']}" for wheel in uv["wheels"]]
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    with tempfile.TemporaryDirectory() as folder:
        requirements = Path(folder) / "uv.txt"
        requirements.write_text(f"uv=={uv['version']} {' '.join(hashes)}\n", encoding="utf-8")
        options = ["--require-hashes", "--only-binary=:all:", "--no-deps", "-r", str(requirements)]
        return subprocess.run([*pip, *options], check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main())
