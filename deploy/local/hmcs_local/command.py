"""The `hmcs` command: arguments in, one call, exit code out."""

from __future__ import annotations

import io
import sys

import typer

from hmcs.errors import UserError
from hmcs.shown import plain
from hmcs_local.added_commands import add_commands
from hmcs_local.commands import (
    demonstrations,
    laboratory,
    operation,
    recognizers,
    recordings,
    stack,
    task,
    training,
)
from hmcs_secure.command import app as secure_app

USER_MISTAKE = 2
_LONGEST_LINE = 4000
"""Characters of an error message that are shown, a line."""

app = typer.Typer(
    help="HMCS: recognizes what an operator's hand is about to do, and lends it a ruler.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
task_app = typer.Typer(help="Work with task files.", no_args_is_help=True)
task_app.command()(task.check)
app.add_typer(task_app, name="task")
app.add_typer(secure_app, name="secure")

_IN_ORDER_OF_HELP = (
    task.new,
    stack.up,
    stack.status,
    recognizers.swap,
    recognizers.deploy,
    stack.router,
    training.train,
    training.cancel,
    operation.devices,
    recordings.record,
    recordings.mark,
    operation.stop,
    operation.play,
    recordings.inspect,
    recordings.label,
    recordings.export,
    recordings.replay,
    demonstrations.check,
    demonstrations.segment,
    recognizers.recognizers,
    laboratory.study,
    laboratory.figures,
)
for _command in _IN_ORDER_OF_HELP:
    app.command()(_command)
add_commands(app)


def main() -> None:
    """Run the command; a mistake of the user is one message and exit code 2, never a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may know ASCII only
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except UserError as error:
        # It may quote what a process or a file says.
        lines = (plain(line, _LONGEST_LINE) for line in str(error).split("\n"))
        sys.stderr.write("hmcs: " + "\n".join(lines) + "\n")
        sys.exit(USER_MISTAKE)


if __name__ == "__main__":
    main()
