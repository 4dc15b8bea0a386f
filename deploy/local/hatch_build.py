"""Puts compose.yaml, which stands at the root of the repository, into what is built of hmcs-local.

An editable install gets no copy: it reads the repository's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

COMPOSE = "compose.yaml"


class WithCompose(BuildHookInterface):
    """A wheel bears it inside the package, a source distribution at its own root."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file to the build; what is built of a source distribution finds it there."""
        root = Path(self.root)
        unpacked = root / COMPOSE
        source = unpacked if unpacked.is_file() else root.parent.parent / COMPOSE
        target = COMPOSE if self.target_name == "sdist" else f"hmcs_local/{COMPOSE}"
        if version != "editable":
            build_data["force_include"][str(source)] = target
