from __future__ import annotations

import io
import json
import logging

import pytest

from hmcs.bus.logs import Seldom, open_log


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_each_event_is_one_line_of_json_where_there_is_no_terminal() -> None:
    stream = io.StringIO()
    log = open_log("probe/json", "info", stream)
    log.info("ready", extra={"endpoint": "tcp/x:1", "names": {1, 2}})
    log.warning("two\nlines")
    first, second = map(json.loads, stream.getvalue().splitlines())
    assert (first["event"], first["endpoint"], first["level"]) == ("ready", "tcp/x:1", "info")
    assert first["process"] == "probe/json"
    assert second["event"] == "two\nlines"


def test_a_traceback_is_part_of_its_event() -> None:
    stream = io.StringIO()
    log = open_log("probe/trace", "info", stream)
    try:
        raise ValueError("boom")
    except ValueError:
        log.exception("failed")
    (line,) = stream.getvalue().splitlines()
    assert "ValueError: boom" in json.loads(line)["traceback"]


def test_people_get_readable_lines() -> None:
    stream = Terminal()
    open_log("probe/tty", "info", stream).info("ready", extra={"steps": 3})
    assert stream.getvalue().endswith("info    probe/tty  ready  steps=3\n")


@pytest.mark.parametrize(("level", "lines"), [("debug", 3), ("info", 2), ("error", 0)])
def test_less_severe_events_are_left_out(level, lines) -> None:
    stream = io.StringIO()
    log = open_log("probe/level", level, stream)
    for write in (log.debug, log.info, log.warning):
        write("x")
    assert len(stream.getvalue().splitlines()) == lines


def test_repeated_events_are_logged_seldom_and_say_how_many_were_left_out(caplog) -> None:
    now_s = [0.0]
    seldom = Seldom(logging.getLogger("seldom"), period_s=5.0, clock=lambda: now_s[0])
    for _ in range(4):
        seldom.warning("a", "lost")
    seldom.warning("b", "other")
    now_s[0] = 5.0
    seldom.warning("a", "lost")
    assert [record.getMessage() for record in caplog.records] == ["lost", "other", "lost"]
    assert caplog.records[-1].left_out == 3
