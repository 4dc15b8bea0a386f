"""What browsers do, well or badly: over a real router, with a browser that is made up."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import msgpack
import numpy as np
import pytest
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from hmcs_console.operating.handles import Alive, Clutched, Grabbed, LetGo, Moved
from hmcs_console.serving.hands import FLOOD

MakeCell = Callable[..., Any]
HERE = np.array([0.6, 0.0, 0.5])


def grab(cell: Any, client: int = 1) -> None:
    cell.service.page.put(Grabbed(client, time.monotonic(), HERE))
    cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")


def test_a_page_that_floods_is_reported_once_and_counted_and_holds_nobody_up(
    make_cell: MakeCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = make_cell(lease_s=2.0)
    notices: list[tuple[int, str]] = []
    page = cell.service.page
    monkeypatch.setattr(page, "tell", lambda client, text: notices.append((client, text)))
    grab(cell, client=1)
    flooding = threading.Event()
    flooding.set()

    def flood() -> None:
        while flooding.is_set():
            page.put(Clutched(2, on=True))
            page.put(Moved(2, time.monotonic(), HERE))

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        gaps_s, last_s = [], time.monotonic()
        cell.until(lambda: notices, "a notice")
        end_s = time.monotonic() + 1.0
        while time.monotonic() < end_s:
            count = len(cell.handles)
            page.put(Alive(1, time.monotonic()))
            cell.until(lambda count=count: len(cell.handles) > count, "a handle")
            gaps_s.append(cell.handles[-1][0] - last_s)
            last_s = cell.handles[-1][0]
        page.put(LetGo(1))
        cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
    finally:
        flooding.clear()
        thread.join()
    assert [client for client, _ in notices] == [2]
    assert cell.bus.counters.refused[FLOOD] > 1000
    assert max(gaps_s[1:]) < 0.5


def browser(cell: Any) -> ClientConnection:
    """A browser, as far as the wire can tell."""
    place = urlsplit(cell.service.url)
    connection = connect(
        f"ws://{place.netloc}",
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        compression=None,
        max_size=None,
    )
    camera(connection)
    cell.until(lambda: cell.service.page._handles, "its handle")
    return connection


def camera(connection: ClientConnection) -> None:
    """Say from where the first page looks, which is what makes it one."""
    axis = (0.0, 0.0, 1.0)
    turn = (1.0, 0.0, 0.0, 0.0)
    tell(
        connection,
        "ViewerCameraMessage",
        **{"wxyz": turn, "position": axis, "look_at": axis, "up_direction": axis},
        **{"fov": 1.0, "near": 0.1, "far": 9.0, "image_height": 9, "image_width": 9},
    )


def tell(connection: ClientConnection, what: str, **fields: Any) -> None:
    connection.send(msgpack.packb({"type": what, **fields}))


def drag(connection: ClientConnection, place: tuple[Any, ...], *phases: str) -> None:
    """Say what a browser says of the handle of the first page."""
    for phase in phases:
        pose = {"wxyz": (1.0, 0.0, 0.0, 0.0), "position": place} if phase == "Update" else {}
        message = f"TransformControls{phase}Message"
        tell(connection, message, name="/handle", owner="0", **pose)


def test_the_pages_own_server_hears_nobody_but_the_door(make_cell: MakeCell) -> None:
    cell = make_cell(lease_s=2.0)
    page = cell.service.page
    with browser(cell):
        stranger = connect(
            f"ws://127.0.0.1:{page.server.get_port()}",
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            compression=None,
            max_size=None,
        )

        def drag_until_closed() -> None:
            camera(stranger)
            drag(stranger, (0.6, 0.0, 0.25), "Update", "DragStart")
            while True:
                stranger.recv(timeout=10.0)

        with stranger, pytest.raises(ConnectionClosed):
            drag_until_closed()
        cell.wait(0.2)
        assert page.viewers == 1
        assert len(page._handles) == 1
        assert not cell.handles


def asked_of(data: bytes) -> list[str]:
    """Numbers of the questions in what the page's server says, whether a page lives."""
    packed = data[16 : 16 + int.from_bytes(data[8:16], "little")]
    size = int.from_bytes(data[:8], "little")
    reported = msgpack.unpackb(
        zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    )
    kind = "LocalStorageGetItemRequestMessage"
    return [said["request_uuid"] for said in reported["messages"] if said["type"] == kind]


@pytest.mark.long
def test_a_still_hand_holds_on_as_long_as_its_page_shows_that_it_lives(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=0.5)
    with browser(cell) as connection:
        living = threading.Event()
        living.set()

        def live() -> None:
            with contextlib.suppress(ConnectionClosed):
                while True:
                    for number in asked_of(connection.recv()):
                        if living.is_set():
                            what = "LocalStorageGetItemResponseMessage"
                            tell(connection, what, value=None, error=None, request_uuid=number)

        thread = threading.Thread(target=live, daemon=True)
        thread.start()
        drag(connection, (0.6, 0.0, 0.5), "Update", "DragStart")
        cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")
        cell.wait(2.0)
        assert cell.handles[-1][1].dead_man
        living.clear()
        cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
    thread.join()


def test_a_burst_of_a_browser_is_cut_and_its_last_position_and_release_come_through(
    make_cell: MakeCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = make_cell(lease_s=2.0)
    page, put = cell.service.page, []
    inner = page.put
    monkeypatch.setattr(page, "put", lambda event: (inner(event), put.append(event)))
    with browser(cell) as connection:
        for number in range(200):
            drag(connection, (0.6, 0.0, 0.001 * number), "DragStart", "Update")
        # Nothing is taken meanwhile.
        deadline_s = time.monotonic() + 10.0
        while sum(isinstance(event, Moved) for event in put) < 200:
            assert time.monotonic() < deadline_s
            time.sleep(0.005)
        cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")
        assert cell.handles[-1][1].position[2] == pytest.approx(0.199)
        assert cell.bus.counters.refused[FLOOD] == 150
        drag(connection, (), "DragEnd")
        cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:.* does not match annotation")
def test_a_browser_that_tells_nonsense_of_its_handle_moves_nothing_and_breaks_nothing(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=2.0)
    with browser(cell) as connection:
        drag(connection, (0.6, 0.0, 0.25), "Update", "DragStart")
        cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")
        for place in ((0.0, 0.0), (float("nan"),) * 3, (1e300,) * 3, ()):
            drag(connection, place, "Update")
        drag(connection, (0.6, 0.0, 0.5), "Update")
        cell.until(lambda: cell.handles[-1][1].position[2] == 0.5, "a place that is one")
        assert {handle.position[2] for _, handle in cell.handles} == {0.25, 0.5}
        drag(connection, (0.0, 0.0), "Update", "DragEnd")
        cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
        for number in range(20):
            cell.move_robot(0.5 + 0.01 * number)
            cell.wait(0.02)
        assert cell.service.health()[0]


def test_a_browser_that_sends_more_than_a_hand_can_is_sent_away_and_has_let_go(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=2.0)
    with browser(cell) as connection:
        drag(connection, (0.6, 0.0, 0.5), "Update", "DragStart")
        cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")
        sent_away = threading.Event()

        def flood() -> None:
            try:
                while True:
                    drag(connection, (0.6, 0.0, 0.5), "Update")
            except ConnectionClosed:
                sent_away.set()

        thread = threading.Thread(target=flood, daemon=True)
        thread.start()
        cell.until(sent_away.is_set, "being sent away")
        cell.until(lambda: not cell.handles[-1][1].dead_man, "the release")
        thread.join()


def test_a_handle_changes_its_arrows_only_while_none_of_them_is_dragged(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(lease_s=2.0)
    page = cell.service.page
    with browser(cell) as connection:
        (viewer,) = page.server.get_clients().values()
        fields = viewer.gui._gui_input_handle_from_uuid
        handle = page._handles[viewer.client_id]

        def choose(kept_to: str) -> None:
            (uuid,) = [uuid for uuid, field in fields.items() if field.label == "Keep to"]
            tell(connection, "GuiUpdateMessage", uuid=uuid, updates={"value": kept_to})
            cell.until(lambda: fields[uuid].value == kept_to, "the choice")

        # Scale is the last of what a page is given.
        cell.until(lambda: "Scale" in [field.label for field in fields.values()], "the fields")
        choose("plane x y")
        cell.until(lambda: handle.active_axes == (True, True, False), "the arrows of a plane")
        drag(connection, (0.6, 0.0, 0.25), "DragStart")
        cell.until(lambda: cell.handles and cell.handles[-1][1].dead_man, "a held handle")
        choose("plane y z")
        drag(connection, (0.7, 0.0, 0.5), "Update")
        cell.until(lambda: cell.handles[-1][1].position[0] == 0.7, "a motion")
        assert handle.active_axes == (True, True, False)
        # In the plane it was taken in it stays.
        assert {reported.position[2] for _, reported in cell.handles} == {0.4}
        drag(connection, (), "DragEnd")
        cell.until(lambda: handle.active_axes == (False, True, True), "the arrows of another")
