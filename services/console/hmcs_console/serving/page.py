"""The page as a server: who looks at it, and what they do with their handles.

Each viewer has a handle of its own at the tool, so that one who only looks moves nobody else's.
Everything a viewer does is put down as an event with its time, for the bus' thread to take.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from hmcs_console.operating.handles import (
    Alive,
    Clutched,
    Event,
    Gone,
    Grabbed,
    LetGo,
    Moved,
    Pedaled,
    Ruled,
    Stopped,
)
from hmcs_console.operating.rules import (
    KEPT_TO,
    LARGEST,
    SMALLEST,
    SPACE,
    Axes,
    position_of,
    rule_of,
)
from hmcs_console.serving.buttons import PLAIN
from hmcs_console.serving.inbox import Inbox, PageEvents, Press
from hmcs_console.serving.server import Server
from hmcs_console.serving.writing import notify

_PULSE_S = 0.05
_NOTICE_S = 4.0
_PEDAL_HZ = 10.0
_HANDLE = "/handle"


class Page:
    """Serves the page, and keeps what its viewers did until `take_events`."""

    def __init__(self, handle_at: NDArray[np.float64], lease_s: float, log: logging.Logger) -> None:
        """Begin with handles at a position, m, base frame, shape (3,)."""
        self.server = Server(log)
        self._handle_at = handle_at
        self._lease_s = lease_s
        self._inbox = Inbox()
        self._handles: dict[int, viser.TransformControlsHandle] = {}
        self._dragging: set[int] = set()
        self._axes: dict[int, Axes] = {}
        """That a handle is to show as soon as it is not dragged."""
        self._held = threading.Event()
        self._holder: int | None = None
        self._closing = False
        self._pulse = threading.Thread(target=self._feel_pulse, name="pulse", daemon=True)
        self._pulse.start()

    @property
    def viewers(self) -> int:
        """How many look at it."""
        return len(self.server.get_clients())

    def serve(self, controls: viser.GuiTabHandle) -> None:
        """Let viewers in; `controls` is where each gets its own clutch and pedal."""

        async def come(client: viser.ClientHandle) -> None:
            self._give_handle(client)
            with controls:
                self._give_controls(client)

        async def go(client: viser.ClientHandle) -> None:
            self._handles.pop(client.client_id, None)
            self._dragging.discard(client.client_id)
            self._axes.pop(client.client_id, None)
            self.put(Gone(client.client_id))

        self.server.on_client_disconnect(go)
        self.server.on_client_connect(come)

    def put(self, event: Event | Press) -> None:
        """Put down what a viewer did, or is to be done for it; from any thread."""
        self._inbox.put(event)

    def take_events(self) -> PageEvents:
        """Take what viewers did since the last time."""
        return self._inbox.take()

    def hold(self, client: int | None) -> None:
        """Ask the page that operates again and again whether it lives; None for no page."""
        self._holder = client
        (self._held.clear if client is None else self._held.set)()

    def lead_handles(self, position: NDArray[np.float64], holder: int | None) -> None:
        """Let the handles nobody holds follow the tool, m, shape (3,)."""
        self._handle_at = position
        for client, handle in list(self._handles.items()):
            # A page that is gone cannot be drawn to; and one may have sent any pose.
            with contextlib.suppress(RuntimeError, ValueError, TypeError):
                if client != holder and not np.allclose(handle.position, position, atol=1e-4):
                    handle.position = position

    def tell(self, client: int, text: str) -> None:
        """Tell one viewer something."""
        viewer = self.server.get_clients().get(client)
        if viewer is not None:
            notify(viewer, text, seconds=_NOTICE_S)

    def close(self) -> None:
        """Send everybody away."""
        self._closing = True
        self._held.set()
        self._pulse.join()
        self.server.stop()

    def _give_handle(self, client: viser.ClientHandle) -> None:
        handle = client.scene.add_transform_controls(
            _HANDLE,
            scale=0.2,
            disable_rotations=True,
            depth_test=False,
            position=self._handle_at,
        )
        self._handles[client.client_id] = handle
        number = client.client_id

        async def drag(event: viser.TransformControlsEvent) -> None:
            now_s, position = time.monotonic(), position_of(event.target.position)
            if event.phase == "end":
                self._dragging.discard(number)
                self.put(LetGo(number))
                self._show_axes(number)
            elif position is None:
                pass
            elif event.phase == "start":
                self._dragging.add(number)
                self.put(Grabbed(number, now_s, position))
            else:
                self.put(Moved(number, now_s, position))

        handle.on_update(drag)

    def _give_controls(self, client: viser.ClientHandle) -> None:
        number = client.client_id
        clutch = client.gui.add_checkbox("Clutch", False, hint="Moves the handle, not the robot")
        pedal = client.gui.add_button(
            "Pedal", color=PLAIN, hint="Hold: a mark, or a cue to the fixture"
        )
        kept_to = client.gui.add_dropdown(
            "Keep to",
            tuple(KEPT_TO),
            initial_value=SPACE,
            hint="Where the handle moves, from when it is next taken",
        )
        scale = client.gui.add_slider(
            "Scale",
            SMALLEST,
            LARGEST,
            0.1,
            1.0,
            hint="Motion of the robot for one of the handle, from when it is next taken",
        )

        async def change_clutch(event: viser.GuiEvent[Any]) -> None:
            self.put(Clutched(number, bool(event.target.value)))

        async def toggle_clutch(_: viser.CommandEvent) -> None:
            clutch.value = not clutch.value  # type: ignore[misc]
            self.put(Clutched(number, clutch.value))

        async def press_pedal(_: object) -> None:
            self.put(Pedaled(number, time.monotonic()))

        async def change_rule(_: viser.GuiEvent[Any]) -> None:
            rule = rule_of(kept_to.value, scale.value)
            self.put(Ruled(number, rule))
            self._axes[number] = rule.axes
            self._show_axes(number)

        async def stop(_: viser.CommandEvent) -> None:
            self.put(Stopped())

        clutch.on_update(change_clutch)
        pedal.on_hold(press_pedal, callback_hz=_PEDAL_HZ)
        kept_to.on_update(change_rule)
        scale.on_update(change_rule)
        # With the mouse on the handle only the keyboard is free.
        client.gui.add_command("Clutch", hotkey="C").on_trigger(toggle_clutch)
        client.gui.add_command("Pedal", hotkey="P").on_trigger(press_pedal)
        client.gui.add_command("Stop", hotkey="S").on_trigger(stop)

    def _show_axes(self, number: int) -> None:
        """Show the arrows a handle is to have, unless it is dragged.

        A page makes a handle anew that has other arrows, and does not tell any more that the old
        one is let go of.
        """
        handle = self._handles.get(number)
        if handle is not None and number not in self._dragging and number in self._axes:
            handle.active_axes = self._axes.pop(number)

    def _feel_pulse(self) -> None:
        """Have the page that operates answer; a still hand tells nothing of it."""
        while True:
            self._held.wait()
            if self._closing:
                return
            number = self._holder
            client = None if number is None else self.server.get_clients().get(number)
            if number is not None and client is not None:
                with contextlib.suppress(RuntimeError, TimeoutError):
                    client.local_storage.get_item("alive", timeout=self._lease_s)
                    self.put(Alive(number, time.monotonic()))
            time.sleep(_PULSE_S)
