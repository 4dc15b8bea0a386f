"""A page of the console in a browser: where things are on it, and hands for its handle."""

from __future__ import annotations

import io
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Ask, Description, Handle, RobotState
from hmcs.bus.session import Bus
from hmcs.bus.wire import decode
from hmcs.task import load_task
from support.stack import Stack

TASK = "human-shapes"
SIZE = (800, 600)
"""The panel stands on the right of it and leaves the middle free."""
COARSE = 0.25
"""Pixels drawn for one of those: a fourth of them is drawn four times as fast without graphics
hardware."""
JAGGED = """(() => {
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, how) {
    const jagged = kind.startsWith("webgl") ? { antialias: false } : {};
    return context.call(this, kind, { ...how, ...jagged });
  };
})()"""
"""Without graphics hardware smooth edges take what the page and the processes under test need."""
PICTURES = Path(__file__).parents[2] / "out" / "browser"
PAGE_S = 60.0
"""A page without graphics hardware takes its time to be there."""
START_S = 60.0
"""A browser beside them leaves services that come up little of the machine."""
DRAG_S = 150.0
"""What takes several movements of the mouse."""
MANY_COLORS = 300
GRIP_M = 0.13
"""Where an arrow of the handle is held, from its foot."""
UP = np.array([0.0, 0.0, 1.0])
LEFT = np.array([0.0, 1.0, 0.0])

SLOW = ("--rate-hz", 5, "--lease-s", 2.0)
"""A page without graphics hardware draws few frames a second, and answers as seldom."""
UNHURRIED = ("--physics-rate-hz", 120, "--state-rate-hz", 60)
"""Of a robot beside a browser that draws without graphics hardware."""

_FIELD_OF_VIEW = np.radians(75.0)
_CAMERA_FROM_START_M = (0.6, -0.8, 0.5)
_GRAB_S = 4.0
_LOOK_S = 0.05


class Heard:
    """The messages of handles and robot, each with its time of arrival."""

    def __init__(self, bus: Bus) -> None:
        self.handles: list[tuple[int, Handle]] = []
        """Each with its monotonic ns."""
        self.robot: list[tuple[int, RobotState]] = []
        bus.listen(bus.keys.handle, self._on_handle)
        bus.listen(bus.keys.robot_state, self._on_robot)

    @property
    def tool(self) -> NDArray[np.float64]:
        """Where the tool is now, m, shape (3,)."""
        return self.robot[-1][1].tool_position

    @property
    def speed(self) -> float:
        """Of the tool now, m/s."""
        return speed_of(self.robot[-1][1])

    @property
    def operator(self) -> str:
        """Who holds the handle now; empty while nobody does."""
        return self.handles[-1][1].operator if self.held else ""

    @property
    def held(self) -> bool:
        """Whether somebody holds the handle now."""
        return bool(self.handles) and self.handles[-1][1].dead_man

    def _on_handle(self, arrival: Arrival) -> None:
        self.handles.append((arrival.received_ns, decode(arrival.payload, Handle)[1]))

    def _on_robot(self, arrival: Arrival) -> None:
        self.robot.append((arrival.received_ns, decode(arrival.payload, RobotState)[1]))


class Cell:
    """A console and whoever it shall be with, and somebody who listens to them."""

    def __init__(
        self,
        stack: Stack,
        *others: tuple[Any, ...],
        task: str | Path | None = TASK,
        console: tuple[Any, ...] = (),
    ) -> None:
        """Bring up a console with more flags; `others` are services with theirs.

        Without a task it learns its states from whoever believes.
        """
        self.stack = stack
        self.bus = stack.open_bus("observer", "o")
        stack.watch(self.bus)
        self.heard = Heard(self.bus)
        flags = ("--port", 0, *(() if task is None else ("--task", task)), *SLOW, *console)
        started = [stack.start("console", "page", *flags)]
        started += [stack.start(name, name, *its_flags) for name, *its_flags in others]
        stack.until_ready(*started, within_s=START_S)
        self.url = self.describe("console", "page")["page"]

    def describe(self, service: str, instance: str) -> dict[str, str]:
        """Return the facts a process tells of itself."""
        key = self.bus.keys.rpc(service, instance, "describe")
        (answer,) = self.bus.ask(key, Ask(), Description, timeout_s=5.0)
        return answer.body.facts


class Viewer:
    """One page, its camera where it is put at the beginning."""

    def __init__(
        self,
        browser: Any,
        cell: Cell,
        task: str | Path = TASK,
        size: tuple[int, int] = SIZE,
        coarse: float = COARSE,
        **context: Any,
    ) -> None:
        """Begin with an empty page in a context of the browser; `open` opens the console's."""
        self.cell = cell
        self._size = size
        self.requests: list[str] = []
        """Whatever it has asked for, addresses of sockets among it."""
        self._context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            device_scale_factor=coarse,
            **context,
        )
        self._context.add_init_script(JAGGED)
        self.page = self._context.new_page()
        self.page.set_default_timeout(PAGE_S * 1e3)
        self._context.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self._start_m = np.array(load_task(task).robot.tool_start_m)

    def open(self) -> None:
        """Open the page and wait until it is drawn."""
        self.page.goto(self.cell.url)
        self.until(lambda: self.page.locator("canvas").count() > 0, within_s=PAGE_S)
        self.until(lambda: self.colors() >= MANY_COLORS, within_s=PAGE_S)

    # --- looking ----------------------------------------------------------------------------------

    def until(self, condition: Callable[[], Any], within_s: float = PAGE_S) -> Any:
        """Look at the page, and pump the bus, until `condition` is true; return what it gave."""
        deadline_s = time.monotonic() + within_s
        while not (value := condition()):
            assert time.monotonic() < deadline_s, f"not on the page within {within_s:g} s"
            self.cell.stack.elapse(_LOOK_S)
        return value

    def sees(self, text: str | re.Pattern[str]) -> bool:
        """Whether a text can be read on the page now."""
        found = self.page.get_by_text(text)
        return any(found.nth(k).is_visible() for k in range(found.count()))

    def picture(self, of: Any = None) -> NDArray[np.uint8]:
        """Return what is on the page, or one element of it, shape (height, width, 3)."""
        data = (of or self.page).screenshot(animations="allow")
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def colors(self) -> int:
        """Return how many colors there are on the left half, where no panel stands."""
        whole = self.picture()
        return len(np.unique(whole[:, : whole.shape[1] // 2].reshape(-1, 3), axis=0))

    def keep_picture(self, name: str) -> None:
        """Write down how the page looks now."""
        PICTURES.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=PICTURES / f"{name}.png")

    def place_of(self, point: ArrayLike) -> tuple[float, float]:
        """Return where a point, m, base frame, stands on the page, px."""
        eye = self._start_m + _CAMERA_FROM_START_M
        ahead = (self._start_m - eye) / np.linalg.norm(self._start_m - eye)
        right = np.cross(ahead, UP)
        right /= np.linalg.norm(right)
        above = np.cross(right, ahead)
        ray = np.asarray(point, dtype=float) - eye
        px = self._size[1] / 2 / np.tan(_FIELD_OF_VIEW / 2) / float(ray @ ahead)
        width, height = self._size
        return width / 2 + px * float(ray @ right), height / 2 - px * float(ray @ above)

    # --- doing ------------------------------------------------------------------------------------

    def open_tab(self, name: str) -> None:
        """Turn to a tab of the panel."""
        self.page.get_by_role("tab", name=name, exact=True).click()

    def press(self, name: str) -> None:
        """Click a button."""
        self.page.get_by_role("button", name=name, exact=True).click()

    def write(self, label: str, text: str) -> None:
        """Write into a field."""
        self._field(label).fill(text)

    def written(self, label: str) -> str:
        """Return what stands in a field."""
        return str(self._field(label).input_value())

    def _field(self, label: str) -> Any:
        words = self.page.locator("label").filter(has_text=re.compile(f"^{label}$"), visible=True)
        # The label is not tied to its field.
        found = words.locator("xpath=ancestor::div[.//input][1]//input")
        return found.filter(visible=True).first

    def choose(self, label: str, option: str) -> None:
        """Take one of what a field offers."""
        self._field(label).click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def reach_for_handle(self, along: NDArray[np.float64] = UP) -> NDArray[np.float64]:
        """Press the mouse on an arrow of the handle; return where the handle's foot is."""
        # Without anybody on the handle it stands at the tool.
        foot = self.cell.heard.tool.copy()
        self.page.mouse.move(*self.place_of(foot + (GRIP_M - 0.01) * along))
        self.page.mouse.move(*self.place_of(foot + GRIP_M * along))
        self.page.mouse.down()
        return foot

    def grab(self, along: NDArray[np.float64] = UP) -> NDArray[np.float64]:
        """Take hold of the handle, with another try where it is not drawn yet; return its foot."""
        heard, deadline_s = self.cell.heard, time.monotonic() + DRAG_S
        while True:
            foot = self.reach_for_handle(along)
            until_s = time.monotonic() + _GRAB_S
            while time.monotonic() < until_s:
                self.cell.stack.pump()
                if heard.held:
                    return foot
            self.page.mouse.up()
            assert time.monotonic() < deadline_s, "the handle cannot be grabbed"

    def lift_to(
        self, foot: NDArray[np.float64], height_m: float, along: NDArray[np.float64] = UP
    ) -> None:
        """Move the mouse so that the held handle stands so far above where its foot was."""
        self.page.mouse.move(*self.place_of(foot + (GRIP_M + height_m) * along))

    def drag(
        self,
        condition: Callable[[], Any],
        height_m: float,
        moves: int,
        along: NDArray[np.float64] = UP,
    ) -> NDArray[np.float64]:
        """Lift the handle in so many moves until `condition` is true; return where its foot was.

        On a machine that is busy a page may be silent for so long that it counts as having let go:
        then the handle is grabbed anew, as its operator would.
        """
        stack, deadline_s = self.cell.stack, time.monotonic() + DRAG_S
        while True:
            foot = self.grab(along)
            for share in np.linspace(0.0, 1.0, moves + 1)[1:]:
                self.lift_to(foot, share * height_m, along)
                stack.elapse(_LOOK_S)
            until_s = time.monotonic() + _GRAB_S
            while time.monotonic() < until_s:
                if condition():
                    return foot
                stack.pump()
            assert time.monotonic() < deadline_s, "dragging the handle has not the effect"
            self.let_go()
            stack.until(lambda: not self.cell.heard.held, DRAG_S)

    def let_go(self) -> None:
        """Release the mouse."""
        self.page.mouse.up()

    def close(self) -> None:
        """Close the page; a second time does nothing."""
        self._context.close()


def speed_of(robot: RobotState) -> float:
    """Return the speed of the tool, m/s."""
    return float(np.linalg.norm(robot.tool_twist[:3]))
