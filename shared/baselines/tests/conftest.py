"""The small task of `support.corner`, as fixtures of these tests."""

from support.corner import model, performances, task

__all__ = ["model", "performances", "task"]
