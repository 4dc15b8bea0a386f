"""Libraries of other formats, which are installed by the extras of `hmcs`."""

from __future__ import annotations

from hmcs.errors import UserError


class MissingLibraryError(UserError):
    """A library that a format needs is not installed; says which."""


def missing(extra: str, why: str) -> MissingLibraryError:
    """Return the error that names what to install for a format."""
    return MissingLibraryError(f"{why}: pip install 'hmcs[{extra}]'")
