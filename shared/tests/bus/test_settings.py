from __future__ import annotations

import subprocess
import sys
from typing import Literal

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.bus.settings import ServiceSettings, SettingsError, as_yaml, load_settings


class ProbeSettings(ServiceSettings):
    """A probe."""

    dead_zone_m: float = 0.01
    """δ, m."""
    gestemes: tuple[str, ...] = ()
    """The gestemes it holds."""
    law: Literal["general", "thesis"] = "general"
    """Which law."""
    gui: bool = False
    """Whether to open a window."""


@pytest.fixture(autouse=True)
def clean_environment(monkeypatch) -> None:
    for name in ("ROUTER", "CELL", "INSTANCE", "DEAD_ZONE_M"):
        monkeypatch.delenv(f"HMCS_{name}", raising=False)


@pytest.fixture
def file(tmp_path):
    def write(content: str) -> str:
        path = tmp_path / "probe.yaml"
        path.write_text(content, encoding="utf-8")
        return str(path)

    return write


def load(*argv: str) -> ProbeSettings:
    return load_settings(ProbeSettings, "probe", argv).settings


def test_file_beats_default_environment_beats_file_command_line_beats_all(
    file, monkeypatch
) -> None:
    options = ["--settings", file("dead_zone_m: 0.02")]
    assert load().dead_zone_m == 0.01
    assert load(*options).dead_zone_m == 0.02
    monkeypatch.setenv("HMCS_DEAD_ZONE_M", "0.03")
    assert load(*options).dead_zone_m == 0.03
    assert load(*options, "--dead-zone-m", "0.04").dead_zone_m == 0.04


def test_a_later_source_changes_only_what_it_names(file) -> None:
    got = load("--settings", file("{dead_zone_m: 0.02, law: thesis}"), "--law", "general")
    assert (got.dead_zone_m, got.law) == (0.02, "general")


def test_lists_come_by_commas_repetition_or_json(monkeypatch) -> None:
    assert load("--gestemes", "line,arc").gestemes == ("line", "arc")
    assert load("--gestemes", "line", "--gestemes", "arc").gestemes == ("line", "arc")
    monkeypatch.setenv("HMCS_GESTEMES", '["line", "arc"]')
    assert load().gestemes == ("line", "arc")


def test_switches_are_set_and_unset_by_name() -> None:
    assert load("--gui").gui
    assert not load("--no-gui").gui


def test_each_process_gets_an_instance_name_of_its_own() -> None:
    assert load().instance != load().instance


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.lists(st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=5)),
)
def test_what_is_printed_gives_the_same_settings_as_a_file(file, dead_zone_m, gestemes) -> None:
    one = ProbeSettings(dead_zone_m=dead_zone_m, gestemes=tuple(gestemes), instance="a")
    assert load("--settings", file(as_yaml(one))) == one


@pytest.mark.parametrize(
    ("argv", "reported"),
    [
        (["--dead-zone", "1"], "unrecognized arguments: --dead-zone 1.*--dead-zone-m"),
        (["--dead-zone-m"], "--dead-zone-m: expected"),
        (["--dead-zone-m", "wide"], "command line: dead_zone_m.*number.*'wide'"),
        (["--dead-zone-m", "nan"], "command line: dead_zone_m: .*finite"),
        (["--law", "newton"], "command line: law: .*'general' or 'thesis', got 'newton'"),
        (["--cell", "a*"], r"command line: cell: .*'a\*' cannot be part of a key"),
        (["--instance", "a/b"], "instance 'a/b' cannot be part of a key"),
        (["--cell", "$"], r"cell '\$' cannot be part of a key"),
        (["--router", "localhost"], "'localhost' is no endpoint: use protocol/address:port"),
        (["--connect-timeout-s", "-1"], "connect_timeout_s: .*greater than 0"),
        (["--settings", "no-such-file.yaml"], "no-such-file.yaml: No such file"),
    ],
)
def test_a_mistake_on_the_command_line_is_reported(argv, reported) -> None:
    with pytest.raises(SettingsError, match=f"(?s){reported}"):
        load(*argv)


@pytest.mark.parametrize(
    ("content", "reported"),
    [
        ("dead_zone: 1", r"probe.yaml: unknown setting dead_zone \(valid ones: .*dead_zone_m"),
        ("dead_zone_m: wide", "probe.yaml: dead_zone_m: .*number"),
        ("dead_zone_m: .nan", "probe.yaml: dead_zone_m: .*finite"),
        ("- 1\n- 2", "probe.yaml: holds a list"),
        ("a: [", "probe.yaml: not YAML: .*line"),
        ("1: 2", "probe.yaml: unknown setting 1"),
    ],
)
def test_a_mistake_in_the_file_is_reported_with_its_name(file, content, reported) -> None:
    with pytest.raises(SettingsError, match=reported):
        load("--settings", file(content))


@pytest.mark.parametrize(
    ("name", "value", "reported"),
    [
        ("DEAD_ZONE_M", "wide", "environment: dead_zone_m"),
        ("GESTEMES", "line,arc", "environment.*gestemes.*JSON"),
        ("CELL", "a/b", "environment: cell.*cannot be part of a key"),
    ],
)
def test_a_mistake_in_the_environment_is_reported(monkeypatch, name, value, reported) -> None:
    monkeypatch.setenv(f"HMCS_{name}", value)
    with pytest.raises(SettingsError, match=reported):
        load()


def test_variables_of_other_services_are_nobodys_mistake(monkeypatch) -> None:
    monkeypatch.setenv("HMCS_REDUNDANCY", "2")
    load()


def test_an_empty_file_changes_nothing(file) -> None:
    assert load("--settings", file("# nothing\n"), "--instance", "a") == load("--instance", "a")


def test_what_is_printed_holds_every_setting() -> None:
    assert set(yaml.safe_load(as_yaml(load()))) == set(ProbeSettings.model_fields)


def test_the_help_says_how_it_is_started_and_not_how_a_default_is_made() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "hmcs_recorder", "--help"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("usage: python -m hmcs_recorder ")
    words = " ".join(done.stdout.split())
    assert "default factory" not in words
    assert "a short random name by default." in words
    assert "(default: 512.0)" in words
