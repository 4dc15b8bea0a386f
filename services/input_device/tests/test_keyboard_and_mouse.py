"""Keyboard and mouse, through listeners that are made up."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from hmcs_input_device.devices.keyboard import Keyboard
from hmcs_input_device.devices.mouse import Mouse
from hmcs_input_device.devices.reading import UnpluggedError


class Listener:
    """What pynput hears with."""

    def __init__(self, **handlers: Callable[..., None]) -> None:
        self.__dict__.update(handlers)
        self.alive = False

    def start(self) -> None:
        self.alive = True

    def stop(self) -> None:
        self.alive = False

    def is_alive(self) -> bool:
        return self.alive


def test_keys_that_are_held_are_axes_and_buttons_until_nobody_listens() -> None:
    keyboard = Keyboard(SimpleNamespace(Listener=Listener))
    listener: Any = keyboard._listener
    keys = [SimpleNamespace(name=n) for n in ("up", "left", "page_down", "ctrl_r", "shift_l")]
    for key in [*keys, SimpleNamespace(char="W"), SimpleNamespace(char=None)]:
        listener.on_press(key)
    reading = keyboard.read()
    assert reading.axes == (-1.0, 1.0, -1.0, 0.0, 0.0, 0.0)
    assert reading.buttons >= {"ctrl_r", "shift", "w"}
    for key in [*keys, SimpleNamespace(char="w")]:
        listener.on_release(key)
    assert keyboard.read()[:2] == ((0.0,) * 6, frozenset())
    assert keyboard.read().report == keyboard.read().report
    before = keyboard.read().report
    listener.on_press(keys[0])
    repeated = keyboard.read().report
    listener.on_press(keys[0])
    assert len({before, repeated, keyboard.read().report}) == 3
    keyboard.close()
    with pytest.raises(UnpluggedError, match="keyboard is gone"):
        keyboard.read()


def test_a_mouse_tells_its_pointer_upward_and_the_buttons_that_are_held() -> None:
    mouse = Mouse(
        SimpleNamespace(Listener=Listener, Controller=lambda: SimpleNamespace(position=(3, 4)))
    )
    listener: Any = mouse._listener
    assert mouse.read().pointer == (3.0, -4.0)
    listener.on_move(10, 2, False)
    listener.on_click(10, 3, SimpleNamespace(name="left"), True, False)
    assert mouse.read()[1:3] == (frozenset({"left"}), (10.0, -3.0))
    before = mouse.read().report
    listener.on_move(10, 3, False)
    assert mouse.read().report != before
    listener.on_click(10, 3, SimpleNamespace(name="left"), False, False)
    assert mouse.read().buttons == frozenset()
