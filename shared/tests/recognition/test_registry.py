"""The registry of recognizers where little is installed."""

from __future__ import annotations

import pytest

from hmcs.errors import UserError
from hmcs.recognition import registry
from hmcs.recognition.registry import DEFAULT, kind_named, kinds


def test_the_default_recognizer_comes_first_and_needs_no_other_distribution() -> None:
    first = kinds()[0]
    assert first.name == DEFAULT
    assert first.learn.__module__.startswith("hmcs.recognition.segment_filter.")


def test_where_the_baselines_are_missing_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alone = {name: entry for name, entry in registry._registered().items() if name == DEFAULT}
    monkeypatch.setattr(registry, "_registered", lambda: alone)
    with pytest.raises(UserError, match=r"unknown recognizer 'lhmm'.*install hmcs-baselines"):
        kind_named("lhmm")
