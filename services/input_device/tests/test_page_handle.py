"""The handle on an operator's page moves as a device, and a hostile page moves nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Handle
from hmcs.bus.wire import encode
from hmcs_input_device import held, press_gate
from support.hand_device import seen

MakeDesk = Callable[..., Any]


@pytest.fixture
def page(make_desk: MakeDesk, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A device that is the handle of a page, and a page."""
    monkeypatch.setattr(press_gate, "HANG_S", 60.0)
    monkeypatch.setattr(held, "SILENT_S", 60.0)
    desk = make_desk(source="page", dead_zone_m=0.02)
    desk.handles = desk.open_bus("console").publisher(Handle, desk.bus.keys.handle)
    return desk


def tell(page: Any, x_m: float, operator: str = "page-1", *, dead_man: bool = True) -> None:
    page.handles.put(
        Handle(operator=operator, position=np.array([x_m, 0.0, 0.0]), dead_man=dead_man)
    )
    received = page.bus.counters.received["handle"]
    page.until(lambda: page.bus.counters.received["handle"] > received, "the handle to be heard")
    seen(page)


def test_a_page_that_is_hostile_leaves_no_trace(page: Any) -> None:
    tell(page, 0.0, dead_man=False)
    tell(page, 0.0)
    assert page.motions[-1].body.dead_man
    for x_m in (1e9, -1e9, 2e4, -2e4):
        tell(page, x_m)
    assert not page.motions[-1].body.dead_man
    assert page.bus.counters.refused["handle"] == 4
    assert "out of reach" in page.service.health()[1]
    for seq in (2**53, 0, 2**52, 1):
        body = Handle(operator="page-1", position=np.full(3, 5.0), dead_man=True)
        stamped = page.handles._stamp(None).model_copy(update={"seq": seq})
        page.handles._publisher.put(encode(body, stamped), attachment=page.handles._sender)
    for operator in ("\x1b[2J", "<script>", "x" * 64, "\u202e", "page-2"):
        tell(page, 0.3, operator)
    assert not page.motions[-1].body.dead_man
    assert np.abs(page.motions[-1].body.position).max() == 0.0
    tell(page, 0.0, dead_man=False)
    tell(page, 0.0)
    page.until(lambda: page.motions[-1].body.dead_man, "a new press")
    assert page.service.health() == (True, "playing")
    tell(page, 0.1)
    page.until(lambda: len(page.steps) >= 2, "steps")
    assert np.abs(page.motions[-1].body.position).max() <= 0.1
