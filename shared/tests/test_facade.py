"""The promised names: all there, and no more imported than is asked for."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import hmcs


@pytest.mark.parametrize("name", hmcs.__all__)
def test_a_promised_name_is_there_and_says_what_it_is(name: str) -> None:
    assert getattr(hmcs, name).__doc__
    assert name in dir(hmcs)


def test_type_checkers_find_each_name_where_it_comes_from_when_the_program_runs() -> None:
    (checked,) = (
        node
        for node in ast.parse(Path(hmcs.__file__).read_text(encoding="utf-8")).body
        if isinstance(node, ast.If)
    )
    for node in checked.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            module = import_module(str(node.module))
            there = getattr(module, alias.name)
            assert getattr(hmcs, alias.asname or alias.name) is there


def test_what_is_not_promised_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'oracle'"):
        hmcs.oracle  # noqa: B018
    with pytest.raises(ImportError, match="oracle"):
        from hmcs import oracle  # noqa: F401


def test_recognition_brings_no_wire_along() -> None:
    code = "import sys; from hmcs import recognizer, train; sys.exit('zenoh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
