"""Reports of trainings come through the page's door: those beside models in its folders alone."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from hmcs.recognition.model_file import load_model, save_model
from hmcs_console.seeing.reports import LARGEST_BYTES, Reports, asked_report, report_name
from hmcs_console.seeing.shelf import LOOK_EVERY_S, Shelf, Shelved, active_first, learned_from
from support.doors import DEADLINE_S, Door

SECRET = b"<script>secret</script>"


@pytest.fixture
def report(model_file: Path) -> Path:
    file = model_file.with_suffix(".html")
    file.write_bytes(b"<!doctype html><h1>Model lines</h1>")
    return file


@pytest.fixture
def door(make_door: Callable[..., Door], model_file: Path) -> Door:
    return make_door(reports=Reports((model_file.parent,)))


# --- over the door --------------------------------------------------------------------------------


def test_the_report_beside_a_model_is_sent_and_can_run_nothing(door: Door, report: Path) -> None:
    sent: Any = door.get("/reports/lines.html")
    assert sent.status == 200
    assert sent.body == report.read_bytes()
    assert sent.headers["Content-Type"] == "text/html; charset=utf-8"
    policy = [part.strip() for part in sent.headers["Content-Security-Policy"].split(";")]
    assert {"default-src 'none'", "sandbox", "frame-ancestors 'none'"} <= set(policy)
    assert not [part for part in policy if part.startswith("script-src")]
    assert sent.headers["X-Content-Type-Options"] == "nosniff"


@pytest.mark.usefixtures("report")
def test_no_other_file_is_sent(door: Door, model_file: Path) -> None:
    folder = model_file.parent
    (folder / "secret.html").write_bytes(SECRET)
    (folder.parent / "above.html").write_bytes(SECRET)
    (folder.parent / "above.hmcs").write_bytes(SECRET)
    for path in (
        *("/reports/secret.html", "/reports/lines.hmcs", "/reports/lines", "/reports/"),
        *("/reports/../above.html", "/reports/..%2fabove.html", "/reports/%2e%2e/above.html"),
        *("/reports/lines.html/", "/reports//lines.html", "/reports/lines%00.html"),
        *("/reports/.html", "/reports/*.html", "/reports/" + "x" * 5000 + ".html"),
    ):
        answer: Any = door.get(path)
        assert answer.status == 404, path
        assert b"secret" not in answer.body
    assert door.get("/reports/lines.html", method="POST").status == 405


@pytest.mark.usefixtures("report")
def test_who_may_not_open_the_page_may_read_no_report(
    make_door: Callable[..., Door], model_file: Path
) -> None:
    door = make_door(reports=Reports((model_file.parent,)), token="a-long-secret")
    assert door.get("/reports/lines.html").status == 401
    assert door.get("/reports/lines.html", Cookie=f"hmcs_console_{door.port}=x").status == 401
    entered = door.get("/reports/lines.html?token=a-long-secret")
    assert entered.status == 303
    cookie = str(entered.headers["Set-Cookie"]).partition(";")[0]
    assert door.get("/reports/lines.html", Cookie=cookie).status == 200
    assert door.get("/reports/lines.html", Cookie=cookie, Host="evil.example").status == 403
    from_elsewhere = {"Cookie": cookie, "Origin": "https://evil.example"}
    assert door.get("/reports/lines.html", **from_elsewhere).status == 403


def test_a_page_stays_open_while_a_report_is_read(make_door: Callable[..., Door]) -> None:
    reading, read = threading.Event(), threading.Event()

    def slowly(_: str) -> bytes:
        reading.set()
        read.wait(DEADLINE_S)
        return b"read"

    door = make_door(reports=slowly)
    with ThreadPoolExecutor(1) as aside:
        asked = aside.submit(door.get, "/reports/x.html")
        assert reading.wait(DEADLINE_S)
        with door.page() as page:
            assert page.recv() == b"hello"
        read.set()
        assert asked.result(DEADLINE_S).status == 200


# --- which files ----------------------------------------------------------------------------------


def test_a_link_that_leads_out_of_the_folder_is_no_report(model_file: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside.html"
    outside.write_bytes(SECRET)
    model_file.with_suffix(".html").symlink_to(outside)
    assert report_name(model_file) == ""
    assert Reports((model_file.parent,))("lines") is None


def test_a_report_too_large_or_gone_is_none(model_file: Path, report: Path) -> None:
    reports = Reports((model_file.parent, Path("/gone")))
    with report.open("ab") as stream:
        stream.truncate(LARGEST_BYTES + 1)
    assert reports("lines") is None
    report.unlink()
    assert reports("lines") is None


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("/reports/first.html", "first"),
        ("/reports/take-1.2_b.html", "take-1.2_b"),
        ("/reports/.hidden.html", ""),
        ("/reports/a b.html", ""),
        ("/", ""),
    ],
)
def test_only_names_of_models_are_asked_for(path: str, name: str) -> None:
    assert asked_report(path) == name


# --- the models there are -------------------------------------------------------------------------


def test_models_are_known_as_soon_as_they_lie_in_a_folder_with_their_reports(
    tmp_path: Path, model_file: Path
) -> None:
    now_s = [0.0]
    shelf = Shelf((tmp_path / "later",), lambda: now_s[0])
    assert shelf.look() == ()
    model = save_model(load_model(model_file)._replace(name="b"), tmp_path / "later" / "b.hmcs")
    (tmp_path / "later" / "broken.hmcs").write_bytes(b"no model")
    assert shelf.look() == ()
    now_s[0] += LOOK_EVERY_S
    assert [(each.name, each.hash, each.report) for each in shelf.look()] == [("b", model.hash, "")]
    (tmp_path / "later" / "b.html").write_text("report")
    now_s[0] += LOOK_EVERY_S
    assert shelf.look()[0].report == "b"
    assert shelf.look() is shelf.look()


def test_a_file_is_read_once_and_again_when_it_has_changed(
    model_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s, read = [0.0], []

    def counted(path: Path) -> Any:
        read.append(path)
        return load_model(path)

    monkeypatch.setattr("hmcs_console.seeing.shelf.load_model", counted)
    shelf = Shelf((model_file,), lambda: now_s[0])
    for _ in range(3):
        shelf.look()
        now_s[0] += LOOK_EVERY_S
    assert len(read) == 1
    save_model(load_model(model_file)._replace(demonstrations=("other", "more")), model_file)
    assert shelf.look()[0].demonstrations == ("other", "more")


ONE, TWO = (Shelved(name, f"hash-{name}", "lhmm", ()) for name in ("one", "two"))


def test_the_active_model_is_offered_first_wherever_its_file_lies() -> None:
    assert active_first((ONE, TWO), "two", "hash-two") == (TWO, ONE)
    assert active_first((ONE, TWO), "two", "") == (TWO, ONE)
    assert active_first((ONE, TWO), "far", "hash-far")[0] == Shelved("far", "hash-far", "", ())
    assert active_first((ONE, TWO), "", "") == (ONE, TWO)


def test_a_recording_knows_the_models_that_were_learned_from_it() -> None:
    names = ("take-1.mcap", "a/take-1.mcap", "take-1.mcap#2", "take-10.mcap", "take-1.mcap#x")
    models = [Shelved(f"m{number}", "", "", (name,)) for number, name in enumerate(names)]
    assert [model.name for model in learned_from(models, "take-1.mcap")] == ["m0", "m1", "m2"]
