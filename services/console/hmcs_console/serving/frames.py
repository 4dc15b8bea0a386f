"""What comes in on a WebSocket of a browser: taken apart, judged, and put together anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.server import ServerProtocol

from hmcs_console.serving.said_by_pages import LONGEST_BYTES, HostileError, NonsenseError, said

MOST_BYTES_A_S = 400_000
"""From one browser; one whose handle is dragged while the camera turns sends a tenth of that."""
MOST_FRAMES_A_S = 2000
MOST_NONSENSE = 100
"""Messages of one connection that were left out: a page that goes on like that is none."""
_HANDED_ON = (Opcode.PING, Opcode.PONG, Opcode.CLOSE)


class Incoming:
    """The frames of one browser; bytes in, frames for the page's own server out."""

    def __init__(self, clock: Callable[[], float], left_out: Callable[[str], None]) -> None:
        """Tell `left_out` why a message was, by the words of a person."""
        self._clock = clock
        self._left_out = left_out
        self._protocol = ServerProtocol(state=State.OPEN, max_size=LONGEST_BYTES)
        self._parts: list[bytes] = []
        self._began_s, self._bytes, self._frames = clock(), 0, 0
        self._nonsense = 0

    def take(self, data: bytes) -> bytes:
        """Return the frames that are to be handed on.

        Raises HostileError for more than a browser sends, and for what it does not send.
        """
        self._count(len(data))
        self._protocol.receive_data(data)
        frames = b"".join(
            frame.serialize(mask=True)
            for event in self._protocol.events_received()
            if isinstance(event, Frame)
            for frame in self._judged(event)
        )
        # The answers it would give are the page's own server's to give.
        self._protocol.data_to_send()
        if self._protocol.parser_exc is not None:
            raise HostileError(f"no frame: {self._protocol.parser_exc}")
        return frames

    def _judged(self, frame: Frame) -> Iterator[Frame]:
        self._frames += 1
        if self._frames > MOST_FRAMES_A_S:
            raise HostileError(f"more than {MOST_FRAMES_A_S} frames a second")
        if frame.opcode in _HANDED_ON:
            yield frame
            return
        if frame.opcode is Opcode.TEXT:
            raise HostileError("a frame of text")
        self._parts.append(bytes(frame.data))
        if frame.fin:
            message, self._parts = b"".join(self._parts), []
            try:
                yield Frame(Opcode.BINARY, said(message))
            except NonsenseError as error:
                self._nonsense += 1
                if self._nonsense > MOST_NONSENSE:
                    raise HostileError(f"nothing but nonsense: {error}") from None
                self._left_out(str(error))

    def _count(self, count: int) -> None:
        now_s = self._clock()
        if now_s - self._began_s >= 1.0:
            self._began_s, self._bytes, self._frames = now_s, 0, 0
        self._bytes += count
        if self._bytes > MOST_BYTES_A_S:
            raise HostileError(f"more than {MOST_BYTES_A_S} bytes a second")
