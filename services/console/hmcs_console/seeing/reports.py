"""Reports of trainings: pages that lie beside models, sent to those who may open the page.

A report is no part of the page: it is a file of pictures and words, and runs nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.bus.keys import is_name
from hmcs.errors import UserError
from hmcs.recognition.model_file import model_files

LARGEST_BYTES = 16 * 1024 * 1024
SUFFIX = ".html"
HEADERS = (
    "Content-Type: text/html; charset=utf-8",
    # Whatever the file holds: no script, no request, no form, no frame.
    "Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; img-src data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; sandbox",
    "Cache-Control: no-store",
)
_ADDRESS = re.compile(r"/reports/(?P<name>[^/%?#]+)\.html")


def address_of(name: str) -> str:
    """Return where a report is served on the page's server."""
    return f"/reports/{name}{SUFFIX}"


def asked_report(path: str) -> str:
    """Return the name of the report that the path of a request asks for; empty where it is none."""
    found = _ADDRESS.fullmatch(path)
    return found["name"] if found is not None and is_name(found["name"]) else ""


def report_name(model: Path) -> str:
    """Return the name by which the report beside a model file is served; empty where none is."""
    with suppress(OSError):
        if is_name(model.stem) and _beside(model) is not None:
            return model.stem
    return ""


class Reports:
    """The reports beside the models in some folders, or files."""

    def __init__(self, places: Iterable[Path]) -> None:
        self._places = tuple(places)

    def __call__(self, name: str) -> bytes | None:
        """Return the report beside the model file of that name; None where there is none to send.

        Names are compared with those of the files there are; no path is made of one.
        """
        for place in self._places:
            with suppress(OSError, UserError):
                for model in model_files(place, may_be_empty=True):
                    report = _beside(model) if model.stem == name else None
                    if report is not None:
                        with suppress(UnreadableFileError):
                            return read_bounded(report, LARGEST_BYTES)
        return None


def _beside(model: Path) -> Path | None:
    """The report beside a model file; None where there is none, or a link that leads elsewhere."""
    try:
        report = model.with_suffix(SUFFIX).resolve(strict=True)
    except (OSError, RuntimeError):
        return None
    return report if report.is_file() and report.parent == model.parent.resolve() else None
