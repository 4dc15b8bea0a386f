"""Task files that tests write."""

from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.task import Problem, check_task
from support.task_files import Check


@pytest.fixture
def check(tmp_path: Path) -> Check:
    """Return a function that checks a text as a task file."""

    def checked(text: str) -> list[Problem]:
        file = tmp_path / "task.yaml"
        file.write_text(text, encoding="utf-8")
        return check_task(file)

    return checked
