"""Recordings that are made up, message by message."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from support.recordings import Maker, Said, hand_of


@pytest.fixture
def maker(tmp_path: Path) -> Maker:
    return Maker(tmp_path / "recordings")


@pytest.fixture
def performed() -> Callable[..., list[Said]]:
    """Messages of a hand that goes through labeled stretches."""

    def perform(labels: Sequence[str | None] = ("go", "turn"), samples: int = 60) -> list[Said]:
        return list(hand_of(labels, samples))

    return perform
