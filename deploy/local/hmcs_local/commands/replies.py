"""Print the replies to a request, and derive the exit code from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from hmcs_local.asking import Replies


def tell_replies(replies: Replies) -> int:
    """Print what each has done, and on stderr who has not; return the exit code."""
    from hmcs_local.asking import left_out

    for reply in replies.each:
        typer.echo(str(reply), err=not reply.done)
    if remark := left_out(replies.strangers):
        typer.echo(remark, err=True)
    return 0 if replies.all_done else 1
