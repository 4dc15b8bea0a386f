from __future__ import annotations

from collections.abc import Iterator

import pytest

pybullet = pytest.importorskip("pybullet", reason="PyBullet has no wheels for this Python")


@pytest.fixture
def client() -> Iterator[int]:
    """A PyBullet client with gravity."""
    number = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=number)
    yield number
    pybullet.disconnect(physicsClientId=number)
