"""The promised names: all there, and no more imported than is asked for."""

from __future__ import annotations

import subprocess
import sys

import pytest

import hmcs


@pytest.mark.parametrize("name", hmcs.__all__)
def test_a_promised_name_is_there_and_says_what_it_is(name: str) -> None:
    assert getattr(hmcs, name).__doc__
    assert name in dir(hmcs)


def test_what_is_not_promised_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'oracle'"):
        hmcs.oracle  # noqa: B018
    with pytest.raises(ImportError, match="oracle"):
        from hmcs import oracle  # noqa: F401


def test_recognition_brings_no_wire_along() -> None:
    code = "import sys; from hmcs import recognizer, train; sys.exit('zenoh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
