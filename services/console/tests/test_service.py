"""The service over a real router, pumped by the test; its page asked over HTTP."""

from __future__ import annotations

import http.client
import re
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from hmcs.bus.messages import Belief, Done, Record, Step
from hmcs.bus.service import UserError
from hmcs.bus.session import RequestRefusedError
from hmcs_console.operating.handles import Alive, Grabbed, LetGo, Moved
from hmcs_console.teaching import requests

MakeCell = Callable[..., Any]
HERE, THERE = np.array([0.6, 0.0, 0.5]), np.array([0.7, 0.0, 0.5])


def get(url: str, path: str = "/", **headers: str) -> tuple[int, http.client.HTTPMessage, str]:
    place = urlsplit(url)
    connection = http.client.HTTPConnection(place.hostname or "", place.port, timeout=10.0)
    try:
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        return response.status, response.headers, response.read().decode()
    finally:
        connection.close()


def grab(cell: Any, client: int = 1) -> None:
    cell.service.page.put(Grabbed(client, time.monotonic(), HERE))
    cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")


def test_the_page_is_served_whole_at_the_reported_port(make_cell: MakeCell) -> None:
    cell = make_cell()
    status, _, html = get(cell.service.facts()["page"])
    assert status == 200
    hosts = set(re.findall(r"https?://([\w.-]+)", html)) | set(
        re.findall(r"(?:src|href)=[\"']//([\w.-]+)", html)
    )
    assert hosts <= {"www.w3.org"}


def test_a_port_that_is_taken_gives_way_to_the_next_and_the_real_one_is_reported(
    make_cell: MakeCell,
) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        cell = make_cell(port=taken)
        page = cell.service.facts()["page"]
        assert urlsplit(page).port != taken
        assert get(page)[0] == 200


def test_a_host_that_is_not_ours_is_reported(make_cell: MakeCell) -> None:
    with pytest.raises(UserError, match=r"the page cannot be served at 203\.0\.113\.1:"):
        make_cell(host="203.0.113.1", token="a long secret")


def test_who_brings_the_token_is_let_in_and_nobody_else(make_cell: MakeCell) -> None:
    url = make_cell(token="a-long-secret").service.url
    assert "secret" not in url
    assert get(url)[0] == 401
    status, headers, _ = get(url, "/?token=a-long-secret")
    assert (status, headers["Location"]) == (303, "/")
    assert get(url, Cookie=headers["Set-Cookie"].partition(";")[0])[0] == 200


def test_a_held_handle_is_reported_often_however_seldom_the_page_is_drawn(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=2.0, rate_hz=2)
    grab(cell)
    count, began_s = len(cell.handles), time.monotonic()
    cell.until(lambda: len(cell.handles) - count > 15, "the handle again and again")
    # Drawn twice a second, the page would have needed eight.
    assert time.monotonic() - began_s < 6.0
    assert all(handle.dead_man for _, handle in cell.handles[count:])


def test_a_held_handle_is_reported_at_a_rate_and_released_once_the_lease_lapses(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=1.5, rate_hz=50)
    grab(cell)
    assert not cell.handles[0][1].dead_man
    began_s = time.monotonic()
    cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
    assert 1.0 < time.monotonic() - began_s < 10.0
    held = [handle for _, handle in cell.handles if handle.dead_man]
    assert len(held) > 5
    assert {handle.operator for handle in held} == {"x-page-1"}
    count = len(cell.handles)
    cell.service.page.put(Moved(1, time.monotonic(), THERE))
    cell.wait(0.3)
    assert len(cell.handles) == count


def test_signs_of_life_keep_the_lease_and_letting_go_ends_it_at_once(make_cell: MakeCell) -> None:
    cell = make_cell(lease_s=0.4)
    grab(cell)
    for _ in range(8):
        cell.service.page.put(Alive(1, time.monotonic()))
        cell.wait(0.1)
    assert cell.handles[-1][1].dead_man
    assert "x-page-1 operates" in cell.service.health()[1]
    cell.service.page.put(LetGo(1))
    cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
    cell.wait(0.2)
    assert not cell.handles[-1][1].dead_man


def test_one_page_operates_at_a_time(make_cell: MakeCell) -> None:
    cell = make_cell(lease_s=2.0)
    grab(cell, client=1)
    cell.service.page.put(Grabbed(2, time.monotonic(), THERE))
    cell.service.page.put(Moved(2, time.monotonic(), THERE))
    cell.wait(0.2)
    assert {handle.operator for _, handle in cell.handles} == {"x-page-1"}
    assert {handle.position[0] for _, handle in cell.handles} == {HERE[0]}


def test_stop_releases_the_handle(make_cell: MakeCell) -> None:
    cell = make_cell(lease_s=2.0)
    grab(cell)
    cell.service.stop()
    cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")


def test_a_console_that_ends_has_let_go(make_cell: MakeCell) -> None:
    cell = make_cell(lease_s=2.0)
    grab(cell)
    cell.close()
    cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")


def test_a_wish_is_carried_out_by_its_process_and_its_answer_is_shown(make_cell: MakeCell) -> None:
    cell = make_cell()
    asked: list[Record] = []

    def record(wish: Record) -> Done:
        asked.append(wish)
        if wish.on:
            return Done(detail="recording peg.hdf5")
        raise RequestRefusedError("nothing is being recorded")

    cell.service.ask(requests.record(True, "peg"))
    cell.until(lambda: "no recorder is there" in cell.service.answer, "a hint")
    cell.other.answer("record", Record, record)
    cell.other.announce(cell.other.keys.presence("recorder", "x"))

    def asked_again() -> bool:
        cell.service.ask(requests.record(True, "peg"))
        cell.wait(0.2)
        return bool(asked)

    cell.until(asked_again, "the presence")
    cell.until(lambda: cell.service.answer == "recording peg.hdf5", "the answer")
    cell.service.ask(requests.record(False, ""))
    cell.until(lambda: "refused: nothing is" in cell.service.answer, "the refusal")
    assert (asked[0], asked[-1]) == (Record(on=True, name="peg"), Record(on=False))


def test_the_pedal_of_any_device_marks_the_parts_of_the_task_one_after_another(
    make_cell: MakeCell, model_file: Path
) -> None:
    cell = make_cell(models=(model_file,))
    steps = cell.other.publisher(Step, cell.other.keys.step)
    reported: list[tuple[str, int]] = []
    for index, mark in enumerate([False, True, False, True, True, True]):
        way = np.array([0.01, 0.0, 0.0])
        steps.put(Step(index=index, position=index * way, displacement=way, mark=mark))
        if mark:
            count = len(reported) + 1
            cell.until(lambda count=count: len(cell.labels) >= count, "a label")  # type: ignore[misc]
            reported.append((cell.labels[-1].state, cell.labels[-1].step))
            assert cell.labels[-1].clock == cell.other.source.boot
    assert reported == [("free", 1), ("in", 3), ("", 4), ("free", 5)]
    cell.service.mark_by_pedal(False)
    cell.until(lambda: not cell.service.marks_by_pedal, "the change")
    way = np.array([0.01, 0.0, 0.0])
    steps.put(Step(index=6, position=6 * way, displacement=way, mark=True))
    cell.service.label("in")
    cell.until(lambda: len(cell.labels) > len(reported), "the button's label")
    assert (cell.labels[-1].state, cell.labels[-1].step) == ("in", 7)


def test_a_label_is_published(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.service.label("in")
    cell.until(lambda: cell.labels, "a label")
    assert cell.labels[0].state == "in"


def test_a_belief_without_a_probability_for_each_state_is_refused(make_cell: MakeCell) -> None:
    cell = make_cell()
    beliefs = cell.other.publisher(Belief, cell.other.keys.belief("lines"))
    cell.until(lambda: beliefs.matching, "the console")
    beliefs.put(
        Belief(
            model_hash="h",
            clock="c",
            step=0,
            states=("in",),
            probabilities=np.array([0.25, 0.75]),
            likely_gesteme="line",
            segment_start=0,
        )
    )
    cell.until(lambda: cell.bus.counters.refused["belief"], "a refusal")


def test_everything_a_task_and_a_model_have_is_drawn(make_cell: MakeCell, model_file: Path) -> None:
    cell = make_cell(models=(model_file,))
    for number in range(20):
        cell.move_robot(0.5 + 0.01 * number)
        cell.wait(0.02)
    assert cell.service.health() == (
        True,
        f"0 viewers at {cell.service.url}, 30 Hz, nobody operates",
    )


def test_a_browser_that_reads_nothing_does_not_hold_up_the_bus(make_cell: MakeCell) -> None:
    cell = make_cell()
    place = urlsplit(cell.service.url)
    with socket.create_connection((place.hostname, place.port)) as browser:
        browser.sendall(
            b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Protocol: viser-v1.1.1\r\n\r\n"
        )
        assert b"101" in browser.recv(12)
        before = cell.bus.counters.received["robot_state"]
        slowest_s = 0.0
        for number in range(100):
            cell.move_robot(0.5 + 0.003 * number)
            began_s = time.monotonic()
            cell.wait(0.01)
            slowest_s = max(slowest_s, time.monotonic() - began_s)
    assert slowest_s < 0.5
    assert cell.bus.counters.received["robot_state"] - before > 50
