from __future__ import annotations

import io
import itertools
import json
import logging
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.logs import MOST_KINDS, JsonLines, RateLimitedLog, open_log


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
    seldom = RateLimitedLog(logging.getLogger("seldom"), period_s=5.0, clock=lambda: now_s[0])
    for _ in range(4):
        seldom.warning("a", "lost")
    seldom.warning("b", "other")
    now_s[0] = 5.0
    seldom.warning("a", "lost")
    assert [record.getMessage() for record in caplog.records] == ["lost", "other", "lost"]
    assert caplog.records[-1].left_out == 3


HOSTILE = "a\x1b[2J\x9b31m\rb\u202ec\u2028d\x00\x7f\ud800"


@pytest.mark.parametrize("stream", [Terminal(), io.StringIO()], ids=["readable", "json"])
def test_no_control_character_from_elsewhere_stands_in_a_line(stream) -> None:
    log = open_log("probe/hostile", "info", stream)
    log.info(HOSTILE, extra={"reason": HOSTILE, "names": [HOSTILE, {HOSTILE: HOSTILE}]})
    try:
        raise ValueError(HOSTILE + "\n12:00:00.000 info    robot/a  ready")
    except ValueError:
        log.warning("failed", exc_info=True)
    written = stream.getvalue()
    assert written.replace("\n", "").isprintable()
    starts = [line[:1] for line in written.splitlines()]
    assert len([start for start in starts if start != " "]) == 2


def test_what_a_json_line_tells_is_exact() -> None:
    stream = io.StringIO()
    open_log("probe/exact", "info", stream).info("x", extra={"reason": HOSTILE})
    assert json.loads(stream.getvalue())["reason"] == HOSTILE


@pytest.mark.parametrize("stream", [Terminal(), io.StringIO()], ids=["readable", "json"])
def test_a_fact_from_elsewhere_makes_no_endless_line(stream) -> None:
    open_log("probe/long", "info", stream).info("x" * 100_000, extra={"reason": "y" * 100_000})
    assert len(stream.getvalue()) < 5000


@given(st.floats(0, 4e9))
def test_the_time_of_a_line_is_the_time_of_its_event(seconds) -> None:
    record = logging.makeLogRecord({"created": seconds, "msg": "x"})
    reported = json.loads(JsonLines("p").format(record))["time"]
    read = datetime.strptime(reported, "%Y-%m-%dT%H:%M:%S.%fZ").replace(tzinfo=UTC).timestamp()
    assert abs(read - seconds) < 1e-6


def test_failures_that_differ_in_what_they_tell_are_of_one_kind(caplog) -> None:
    seldom = RateLimitedLog(logging.getLogger("seldom"), clock=lambda: 0.0)
    for step in range(1000):
        seldom.warning(f"BadStepError: step {step} of {step:x}", "a handler failed: going on")
        seldom.warning(f"sample {step}", "sample refused")
    assert len(caplog.records) == 2


def test_what_comes_of_different_keys_is_of_different_kinds(caplog) -> None:
    seldom = RateLimitedLog(logging.getLogger("seldom"), clock=lambda: 0.0)
    seldom.warning("lost cell/model/m/evidence/classifier-1", "lost")
    seldom.warning("lost cell/model/m/evidence/classifier-2", "lost")
    assert len(caplog.records) == 2


def test_kinds_that_are_made_up_are_bounded_and_what_was_left_out_is_reported(caplog) -> None:
    now_s = [0.0]
    seldom = RateLimitedLog(logging.getLogger("seldom"), period_s=5.0, clock=lambda: now_s[0])
    names = ["".join(word) for word in itertools.product("abcdefghij", repeat=3)]
    for name in names:
        seldom.warning(f"refused {name}", "refused")
        seldom.warning(f"refused {name}", "refused")
    assert len(caplog.records) == MOST_KINDS
    assert len(seldom._last_s) == MOST_KINDS
    now_s[0] = 5.0
    for name in names:
        seldom.warning(f"refused {name}", "refused")
    assert len(caplog.records) == 2 * MOST_KINDS
    assert len(seldom._last_s) + len(seldom._left_out) <= 2 * MOST_KINDS
    now_s[0] = 10.0
    seldom.warning("another", "refused")
    reported = sum(
        getattr(record, fact, 0)
        for record in caplog.records
        for fact in ("left_out", "others_left_out")
    )
    # Of each event a line, or a count in a later one; those of kinds still followed may wait.
    waiting = sum(seldom._left_out.values())
    assert len(caplog.records) + reported + waiting == 3 * len(names) + 1
