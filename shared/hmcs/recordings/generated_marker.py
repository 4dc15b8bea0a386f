"""Files that were found rather than written by somebody: they may be found anew, as long as nobody
has changed them."""

from __future__ import annotations

import zlib
from pathlib import Path

from hmcs.errors import UserError

COMMENT = "#"
_MARK = f"{COMMENT} found by hmcs; whoever changes a line makes it his own: "
_OLDER_MARK = (
    f"{COMMENT} found by hmcs train --find-states; whoever changes a line makes it his own: "
)


def with_generated_marker(text: str) -> str:
    """Return the text of a file, whole lines, with a last line that says that it was found."""
    return f"{text}{_MARK}{_sum(text)}\n"


def is_unchanged_generated(file: Path) -> bool:
    """Return whether a file was found and is unchanged since; False where there is none.

    Raises UserError where it cannot be read.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (FileNotFoundError, UnicodeDecodeError):
        return False
    except OSError as error:
        raise UserError(f"{file}: cannot be read: {error.strerror or error}") from error
    for marked in (_MARK, _OLDER_MARK):
        before, mark, said = text.rpartition(marked)
        if mark and said == f"{_sum(before)}\n":
            return True
    return False


def _sum(text: str) -> str:
    return f"{zlib.crc32(text.encode()):08x}"
