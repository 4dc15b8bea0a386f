"""The `hmcs` command: arguments in, one call, exit code out."""

from __future__ import annotations

import errno
import io
import os
import sys
from contextlib import suppress
from importlib.metadata import version
from typing import Annotated, NoReturn

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
    robot,
    stack,
    task,
    training,
)
from hmcs_secure.command import app as secure_app

USER_MISTAKE, OUTPUT_FAILED = 2, 1
_OUTPUT_FAILS = (errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EFBIG)
_LONGEST_LINE = 4000
"""Characters of an error message that are shown, a line."""


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"hmcs {version('hmcs')}")
        raise typer.Exit


app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
task_app = typer.Typer(help="Work with task files.", no_args_is_help=True)
task_app.command()(task.check)
app.add_typer(task_app, name="task")
robot_app = typer.Typer(
    help="Look at robots, one's own and those that come along.", no_args_is_help=True
)
robot_app.command()(robot.check)
robot_app.command("list")(robot.list_robots)
app.add_typer(robot_app, name="robot")
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
    recordings.view,
    recordings.replay,
    demonstrations.check,
    demonstrations.segment,
    recognizers.recognizers,
    laboratory.study,
    laboratory.figures,
)
for _command in _IN_ORDER_OF_HELP:
    app.command()(_command)
# `import` is a word of Python's own.
app.command("import")(demonstrations.import_files)
add_commands(app)


@app.callback()
def common(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """HMCS: recognizes what an operator's hand is about to do, and guides it along its path."""


def main() -> None:
    """Run the command; a mistake of the user is one message and exit code 2, never a traceback.

    Where its output cannot be written the exit code is 1.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may know ASCII only
            stream.reconfigure(errors="backslashreplace")
    try:
        try:
            app(prog_name="hmcs")
        finally:
            sys.stdout.flush()
    except UserError as error:
        _fail(str(error), USER_MISTAKE)
    except OSError as error:
        if error.filename is not None:
            _fail(f"{error.filename}: {error.strerror or error}", USER_MISTAKE)
        elif error.errno in _OUTPUT_FAILS:
            # What is left unwritten is not tried again at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            _fail(f"cannot write its output: {error.strerror}", OUTPUT_FAILED)
        else:
            raise


def _fail(message: str, code: int) -> NoReturn:
    # It may quote what a process or a file says.
    lines = (plain(line, _LONGEST_LINE) for line in message.split("\n"))
    with suppress(OSError):
        sys.stderr.write("hmcs: " + "\n".join(lines) + "\n")
        sys.stderr.flush()
    sys.exit(code)


if __name__ == "__main__":
    main()
