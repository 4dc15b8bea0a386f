"""The page as a document: one file, and what a browser may do with it."""

from __future__ import annotations

import base64
import gzip
import re
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import viser

from hmcs_console.serving.appearance import with_appearance

_FILE = Path(viser.__file__).parent / "client" / "build" / "index.html"
_SCRIPT = re.compile(rb"<script\b[^>]*>(.*?)</script>", re.DOTALL)


class Document(NamedTuple):
    """What is sent to a browser."""

    body: bytes
    zipped: bytes
    headers: tuple[str, ...]
    """`name: value`."""


def load_document() -> Document:
    """Return the page of the library, with a policy that lets no other program run in it.

    Only the script that stands in the file runs, and what that brings along; nothing is asked from
    or sent to elsewhere, and no other page may hold this one in a frame.
    """
    body = with_appearance(_FILE.read_bytes())
    own = " ".join(f"'sha256-{_digest(found[1])}'" for found in _SCRIPT.finditer(body))
    policy = {
        "default-src": "'none'",
        # The library's WebAssembly makes functions of strings; markup cannot.
        "script-src": f"{own} 'strict-dynamic' 'unsafe-eval'",
        "style-src": "'unsafe-inline'",
        "img-src": "'self' data: blob:",
        "media-src": "data:",
        "font-src": "data:",
        "connect-src": "'self' data: blob:",
        "worker-src": "blob: data:",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    headers = (
        "Content-Type: text/html; charset=utf-8",
        "Content-Security-Policy: " + "; ".join(f"{what} {who}" for what, who in policy.items()),
        "Cache-Control: no-store",
    )
    return Document(body, gzip.compress(body, mtime=0), headers)


def _digest(script: bytes) -> str:
    # A browser hashes what it reads, and it reads every kind of line end as one.
    read = script.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return base64.b64encode(sha256(read).digest()).decode()
