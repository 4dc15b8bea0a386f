"""Who operates, as each viewer reads it."""

from __future__ import annotations

from typing import Any

import pytest

from hmcs.bus.keys import Member
from hmcs_console.seeing.seen import ANSWER_S, Picture, Seen
from hmcs_console.telling.operators import operates

DEVICE = {Member("input_device", "i"): None}


def picture(operating: int | None = None, **fields: Any) -> Picture:
    seen = Seen(("one", "two"))
    return seen.picture(0.0, "", operating)._replace(**{"health": DEVICE, **fields})


@pytest.mark.parametrize(
    ("moment", "said"),
    [
        (picture(3), "**You operate.**"),
        (picture(4), "**Another page operates.**"),
        (picture(device="recorded", lost={3: "silent"}), "**The source *recorded* drives**"),
        (picture(health={}), "no input device is there"),
        (picture(lost={3: "this page was silent"}), "any more**: this page was silent"),
        (picture(lost={4: "this page was silent"}), "Nobody operates."),
        (picture(device="page"), "Next: open *Teach*"),
        (picture(active="peg", unrun="peg"), "Next: open *Teach*"),
        (picture(active="peg"), "Next: take the handle"),
    ],
)
def test_a_viewer_reads_who_operates_and_what_to_do_next(moment: Picture, said: str) -> None:
    assert said in operates(moment, 3)


def test_an_answer_fades_unless_a_robot_may_still_move() -> None:
    seen = Seen(())
    for answer, stays in (("robot r stands", False), ("robot r **may still move**: mute", True)):
        seen.answer = answer
        assert seen.picture(50.0, "", None).answer == answer
        later = seen.picture(50.0 + ANSWER_S, "", None).answer
        assert later == (answer if stays else "")
        assert seen.answer == answer
