"""The site of the documents: its navigation names everything, and it builds without a warning."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
SITE = ROOT / "docs" / "site"


def loaded(name: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """One of the modules that make the site; they are no package."""
    monkeypatch.syspath_prepend(str(SITE))
    return importlib.import_module(name)


def named(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    navigation = loaded("navigation", monkeypatch).navigation()
    return {page for pages in navigation.values() for page in pages}


@pytest.mark.long
def test_the_navigation_names_every_document(monkeypatch: pytest.MonkeyPatch) -> None:
    documents = {
        path.relative_to(ROOT).with_suffix("").as_posix() for path in ROOT.glob("docs/**/*.md")
    }
    api = {page for page in named(monkeypatch) if page.startswith("docs/api/")}
    assert documents <= named(monkeypatch)
    assert all((ROOT / f"{page}.md").is_file() for page in named(monkeypatch) - api)


def test_the_navigation_names_every_room_and_every_program(monkeypatch: pytest.MonkeyPatch) -> None:
    rooms = [
        path.parent.relative_to(root)
        for root in (ROOT / "shared", ROOT / "shared/baselines")
        for path in root.glob("hmcs*/**/__init__.py")
    ]
    names = {str(room).replace("/", ".") for room in rooms}
    names |= {
        path.name for path in (*ROOT.glob("services/*/hmcs_*"), *ROOT.glob("deploy/*/hmcs_*"))
    }
    assert {"hmcs", "hmcs.recognition.hmm", "hmcs_robot"} <= names
    assert {f"docs/api/{name}" for name in names} <= named(monkeypatch)


def test_api_pages_document_rooms_whole_and_programs_by_their_settings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pages = loaded("api_pages", monkeypatch).pages()
    assert (
        ".. automodule:: hmcs.recognition.hmm.inference\n   :members:"
        in (pages["hmcs.recognition.hmm"])
    )
    assert ".. automodule:: hmcs_robot.settings\n   :members:" in pages["hmcs_robot"]
    assert "hmcs_robot.service" not in pages["hmcs_robot"]


@pytest.mark.parametrize(
    ("prose", "restructured"),
    [
        ("takes *args and |x|", r"takes \*args and \|x\|"),
        ("log P(o_1..o_t)", r"log P(o\ :sub:`1`\ ..o\ :sub:`t`\ )"),
        ("A_{i,j} of `log_emission`", r"A\ :sub:`i,j`\  of `log_emission`"),
        ("`{k: v}` and ``a_`` stay", "``{k: v}`` and ``a_`` stay"),
        ("a *gesteme* is", "a *gesteme* is"),
        ("an own_name is no formula", "an own_name is no formula"),
    ],
)
def test_docstrings_are_read_as_prose(
    prose: str, restructured: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = loaded("plain_docstrings", monkeypatch).as_restructured_text
    assert read([prose]) == [restructured]


def test_links_that_lead_nowhere_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="#here"><a href="b.html#there"><a href="https://example.org">'
        '<script src="https://example.org/x.js"></script><a href="c.html"><a href="#gone">',
        encoding="utf-8",
    )
    (tmp_path / "b.html").write_text('<p id="there">', encoding="utf-8")
    assert loaded("links", monkeypatch).problems(tmp_path) == [
        "a.html: #gone: no such place on the page",
        "a.html: c.html: no such file",
        "a.html: https://example.org/x.js: is loaded from outside the site",
    ]


@pytest.mark.skipif(
    importlib.util.find_spec("sphinx") is None, reason="`make docs` installs Sphinx"
)
def test_the_site_builds_without_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going"),
            *("--conf-dir", "docs/site", "--doctree-dir", str(tmp_path / "cache")),
            *(".", str(tmp_path / "site")),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert loaded("links", monkeypatch).problems(tmp_path / "site") == []
