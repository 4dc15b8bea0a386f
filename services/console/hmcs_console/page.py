"""The page as a server: who looks at it, and what they do with their handles.

Each viewer has a handle of its own at the tool, so that one who only looks moves nobody else's.
Everything a viewer does is put down as an event with its time, for the bus' thread to take.
"""

from __future__ import annotations

import contextlib
import io
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from hmcs_console.operating import Alive, Clutched, Event, Gone, Grabbed, LetGo, Moved, Pedaled

_PULSE_S = 0.05
_PEDAL_HZ = 10.0
_HANDLE = "/handle"


class Server(viser.ViserServer):
    """A viser server that nobody can make reach beyond this machine."""

    def __init__(self) -> None:
        with _quietly():
            super().__init__(host="127.0.0.1", port=0, label="HMCS", verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: a tunnel would let strangers move the robot."""
        return None

    def stop(self) -> None:
        """End, with all its threads."""
        with _quietly():
            super().stop()


class Page:
    """Serves the page, and keeps what its viewers did until `take_events`."""

    def __init__(self, handle_at: NDArray[np.float64], lease_s: float) -> None:
        """Begin with handles at a position, m, base frame, shape (3,)."""
        self.server = Server()
        self._handle_at = handle_at
        self._lease_s = lease_s
        self._events: deque[Event | Callable[[], None]] = deque()
        self._handles: dict[int, viser.TransformControlsHandle] = {}
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
            self.put(Gone(client.client_id))

        self.server.on_client_disconnect(go)
        self.server.on_client_connect(come)

    def put(self, event: Event | Callable[[], None]) -> None:
        """Put down what a viewer did, or is to be done for it; from any thread."""
        self._events.append(event)

    def take_events(self) -> Iterator[Event | Callable[[], None]]:
        """Take what viewers did since the last time, oldest first."""
        while self._events:
            yield self._events.popleft()

    def hold(self, client: int | None) -> None:
        """Ask the page that operates again and again whether it lives; None for no page."""
        self._holder = client
        (self._held.clear if client is None else self._held.set)()

    def lead_handles(self, position: NDArray[np.float64], holder: int | None) -> None:
        """Let the handles nobody holds follow the tool, m, shape (3,)."""
        self._handle_at = position
        for client, handle in list(self._handles.items()):
            if client != holder and not np.allclose(handle.position, position, atol=1e-4):
                with contextlib.suppress(RuntimeError):
                    handle.position = position

    def tell(self, client: int, text: str) -> None:
        """Tell one viewer something."""
        viewer = self.server.get_clients().get(client)
        if viewer is not None:
            viewer.add_notification("Operating", text, auto_close_seconds=4.0, color="orange")

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
            now_s, position = time.monotonic(), np.array(event.target.position, dtype=float)
            if event.phase == "start":
                self.put(Grabbed(number, now_s, position))
            elif event.phase == "update":
                self.put(Moved(number, now_s, position))
            else:
                self.put(LetGo(number))

        handle.on_update(drag)

    def _give_controls(self, client: viser.ClientHandle) -> None:
        number = client.client_id
        clutch = client.gui.add_checkbox("Clutch", False, hint="Moves the handle, not the robot")
        pedal = client.gui.add_button("Pedal", hint="Hold: a mark, or a cue to the fixture")

        async def change_clutch(event: viser.GuiEvent[Any]) -> None:
            self.put(Clutched(number, bool(event.target.value)))

        async def toggle_clutch(_: viser.CommandEvent) -> None:
            clutch.value = not clutch.value  # type: ignore[misc]
            self.put(Clutched(number, clutch.value))

        async def press_pedal(_: object) -> None:
            self.put(Pedaled(number, time.monotonic()))

        clutch.on_update(change_clutch)
        pedal.on_hold(press_pedal, callback_hz=_PEDAL_HZ)
        # With the mouse on the handle only the keyboard is free.
        client.gui.add_command("Clutch", hotkey="C").on_trigger(toggle_clutch)
        client.gui.add_command("Pedal", hotkey="P").on_trigger(press_pedal)

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


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    # The library greets and takes its leave on standard output, where it has no business.
    with contextlib.redirect_stdout(io.StringIO()):
        yield
