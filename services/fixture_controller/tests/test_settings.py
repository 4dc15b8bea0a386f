from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hmcs.bus.service import UserError
from hmcs.bus.settings import load_settings
from hmcs_fixture_controller.models import load_models
from hmcs_fixture_controller.settings import FixtureControllerSettings


def load(*arguments: str) -> FixtureControllerSettings:
    loaded = load_settings(FixtureControllerSettings, "fixture_controller", arguments)
    assert isinstance(loaded.settings, FixtureControllerSettings)
    return loaded.settings


def test_milliseconds_reach_the_science_as_seconds() -> None:
    safeguards = load("--input-stale-after-ms", "80", "--belief-stale-after-ms", "120").safeguards
    assert safeguards.input_stale_after_s == pytest.approx(0.08)
    assert safeguards.belief_stale_after_s == pytest.approx(0.12)


@pytest.mark.parametrize("value", ["0", "-1", "nan", "never"])
def test_a_timeout_that_is_none_is_refused(value: str) -> None:
    with pytest.raises(UserError, match="input_stale_after_ms"):
        load("--input-stale-after-ms", value)


def test_models_come_from_files_and_folders(make_model: Callable[..., Path]) -> None:
    one, two = make_model("one"), make_model("two", folder="more")
    assert set(load_models([one, two.parent])) == {"one", "two"}


def test_one_file_named_twice_is_one_model(make_model: Callable[..., Path]) -> None:
    path = make_model()
    assert set(load_models([path, path.parent])) == {"lines"}


def test_two_models_of_one_name_are_refused(make_model: Callable[..., Path]) -> None:
    paths = [make_model(length_m=0.5), make_model(length_m=0.6, folder="more")]
    with pytest.raises(UserError, match="a second, different model named 'lines'"):
        load_models(paths)


def test_a_folder_without_models_is_reported(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no model file \(\*.hmcs\) in this folder"):
        load_models([tmp_path])


def test_a_truncated_model_file_is_reported(make_model: Callable[..., Path]) -> None:
    path = make_model()
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(UserError, match="truncated"):
        load_models([path])
