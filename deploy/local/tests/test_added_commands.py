from __future__ import annotations

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from hmcs.errors import UserError
from hmcs_local import added_commands


def install(folder: Path, name: str, source: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install a distribution that brings one subcommand, the function `run` of its module."""
    module = f"brings_{name}"
    (folder / f"{module}.py").write_text(source, encoding="utf-8")
    info = folder / f"{module}-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Name: {module}\nVersion: 1\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(
        f"[{added_commands.GROUP}]\n{name} = {module}:run\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(folder)


def with_added_commands() -> typer.Typer:
    app = typer.Typer()
    app.command("own")(lambda: typer.echo("own"))
    added_commands.add_commands(app)
    return app


def test_subcommand_of_another_distribution_is_one_of_hmcs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = "def run(times: int = 1) -> None:\n    print('waves ' * times)\n"
    install(tmp_path, "wave", source, monkeypatch)
    done = CliRunner().invoke(with_added_commands(), ["wave", "--times", "2"])
    assert done.exit_code == 0
    assert "waves waves" in done.output


def test_subcommand_that_cannot_be_loaded_is_refused_and_the_others_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, "broken", "import no_such_module", monkeypatch)
    app = with_added_commands()
    assert CliRunner().invoke(app, ["own"]).output == "own\n"
    refused = CliRunner().invoke(app, ["broken"]).exception
    assert isinstance(refused, UserError)
    assert "hmcs broken" in str(refused)
    assert "no_such_module" in str(refused)


@pytest.mark.parametrize("words", [[], ["--help"], ["--output", "here", "--seed=3"]])
def test_demo_that_is_not_installed_says_what_to_install(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(added_commands, "entry_points", lambda **_: ())
    refused = CliRunner().invoke(with_added_commands(), ["demo", *words]).exception
    assert isinstance(refused, UserError)
    assert "install it beside hmcs-local" in str(refused)
    assert "--with hmcs-demo" in str(refused)
