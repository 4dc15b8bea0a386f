"""Names of what is in the scene: one part of a path each, whatever it was called elsewhere."""

from __future__ import annotations

from urllib.parse import quote

_LONGEST = 80


def node(*names: str) -> str:
    """Return the path of a node, from the outermost to its own name.

    Of a name letters, digits, `.`, `_`, `-` and `~` stay; all else is written in percent signs, so
    that a slash or two dots lead nowhere else.
    """
    return "".join(f"/{_part(name)}" for name in names)


def node_in(path: str) -> str:
    """Return a path whose parts were called by somebody else."""
    return node(*path.strip("/").split("/"))


def _part(name: str) -> str:
    quoted = quote(name[:_LONGEST].encode("utf-8", "backslashreplace"), safe="")
    return quoted.replace(".", "%2E") if quoted.strip(".") == "" else quoted
