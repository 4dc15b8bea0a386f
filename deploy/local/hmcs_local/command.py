"""The `hmcs` command: arguments in, one call, exit code out."""

from __future__ import annotations

import io
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.text import Text

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.errors import UserError
from hmcs.shown import plain
from hmcs_local.stack import DEFAULT_FOLDER, LocalStack
from hmcs_secure.command import app as secure_app

if TYPE_CHECKING:
    from hmcs_local.asking import Replies

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
app.add_typer(task_app, name="task")
app.add_typer(secure_app, name="secure")

_Router = Annotated[
    str, typer.Option(envvar="HMCS_ROUTER", metavar="ENDPOINT", help="Where the router is.")
]
_Cell = Annotated[
    str, typer.Option(envvar="HMCS_CELL", metavar="NAME", help="Which operator and robot.")
]
_Secure = Annotated[
    str | None,
    typer.Option(
        envvar="HMCS_SECURE",
        metavar="CELL",
        help="The closed cell of this name, or the folder of its certificates, see `hmcs secure`; "
        "in place of --cell.",
    ),
]
_Open = Annotated[
    bool,
    typer.Option(
        "--open-to-network",
        envvar="HMCS_OPEN_TO_NETWORK",
        help="Let the router listen beyond this machine without TLS: everybody who reaches its "
        "port can move the robot.",
    ),
]
_Folder = Annotated[
    Path, typer.Option(metavar="DIR", help="Where `hmcs up` keeps logs, models and recordings.")
]


@app.command()
def up(
    services: Annotated[
        str,
        typer.Option(
            metavar="A,B,…",
            help="Start these services only. Without `router` among them, the one at --router "
            "is joined.",
        ),
    ] = "",
    scale: Annotated[
        list[str] | None,
        typer.Option(metavar="SERVICE=N", help="So many instances of a service; may be repeated."),
    ] = None,
    router: Annotated[
        str,
        typer.Option(
            metavar="ENDPOINT", help="Where the embedded router listens; port 0: any free one."
        ),
    ] = DEFAULT_ROUTER,
    compose: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The stack; compose.yaml by default.")
    ] = None,
    folder: _Folder = DEFAULT_FOLDER,
    open_to_network: _Open = False,
    secure: _Secure = None,
    signed_models: Annotated[
        bool,
        typer.Option(
            "--signed-models",
            help="With --secure: no process loads a model that is not signed for the cell, see "
            "`hmcs secure sign`.",
        ),
    ] = False,
) -> None:
    """Run the stack of compose.yaml as processes here, with the router embedded.

    With --secure every process comes with its certificate, and the router refuses everybody else.
    Ctrl-C ends them all. `${NAME}` in compose.yaml is taken from the environment.
    """
    from hmcs_local.launcher import run_up
    from hmcs_secure.closed_cell import find_closed_cell
    from hmcs_secure.router_file import DEFAULT_LISTEN

    if signed_models and not secure:
        raise UserError("--signed-models: name the closed cell whose key counts, by --secure")
    closed = find_closed_cell(secure, signed_models=signed_models) if secure else None
    if closed is not None and router == DEFAULT_ROUTER:
        router = DEFAULT_LISTEN
    chosen = tuple(name.strip() for name in services.split(",") if name.strip())
    console = Console(highlight=False, soft_wrap=True)
    code = run_up(
        lambda while_waiting: LocalStack(
            compose,
            services=chosen or None,
            scale=dict(_scale(item) for item in scale or []),
            router=router,
            folder=folder,
            open_to_network=open_to_network,
            closed=closed,
            while_waiting=while_waiting,
        ),
        lambda who, what: console.print(_line(who, what)),
    )
    raise typer.Exit(code)


@app.command()
def status(
    once: Annotated[bool, typer.Option("--once", help="Show it once and end.")] = False,
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
) -> None:
    """Show who is there, how each is, rates, losses and the active model, and whether it is run.

    With --once, the exit code is 0 when somebody is there, everybody is healthy and somebody runs
    the model that is followed, else 1.
    """
    from hmcs_local.connecting import open_observer
    from hmcs_local.status import show_status

    with open_observer(router, cell, secure) as bus:
        well = show_status(bus, Console(), once=once)
    raise typer.Exit(0 if well else 1)


@app.command()
def swap(
    instance: Annotated[
        str | None,
        typer.Argument(help="The gesteme classifier to replace, as `hmcs status` names it."),
    ] = None,
    command: Annotated[
        str,
        typer.Option("--with", metavar="COMMAND", help="What to start in its place."),
    ] = "",
    activate: Annotated[
        str, typer.Option(metavar="MODEL", help="The recognizer the fixture is to follow.")
    ] = "",
    load: Annotated[
        str,
        typer.Option(
            metavar="FILE", help="Its model file, where the fixture controller does not have it."
        ),
    ] = "",
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Replace a classifier, or activate another recognizer, while the stack runs.

    `hmcs swap gesteme-classifier-1` starts a fresh classifier (another program with --with), waits
    until it has replayed the last steps and is ready, and only then stops the old one: no step
    goes without evidence. If the newcomer is not ready within 10 s, it is stopped and the old one
    goes on. Both belong to the `hmcs up` of --folder.

    `hmcs swap --activate MODEL` lets the fixture follow the belief of another recognizer that runs
    already, in the shadow of the active one. The exit code is 1 where only some fixtures answer.
    """
    from hmcs_local import swap as swapping
    from hmcs_local.connecting import open_operator
    from hmcs_local.control import Control
    from hmcs_local.interrupts import interruptible

    if bool(instance) == bool(activate) or (command and not instance) or (load and instance):
        raise UserError("name either a classifier to replace or a model to --activate")
    with interruptible(), open_operator(router, cell, secure) as bus:
        if instance:
            swapping.replace_classifier(
                bus, Control(folder), instance, command=shlex.split(command), tell=typer.echo
            )
            return
        partly = False
        for change, what in ((swapping.load, load), (swapping.activate, activate)):
            try:
                if what:
                    typer.echo(change(bus, what))
            except swapping.PartlySwappedError as error:
                typer.echo(error, err=True)
                partly = True
    raise typer.Exit(int(partly))


@app.command()
def deploy(
    model: Annotated[
        Path | None, typer.Argument(help="The model file whose recognizer is to take over.")
    ] = None,
    back: Annotated[
        bool, typer.Option("--back", help="Return to the model that was active before.")
    ] = False,
    watch_s: Annotated[
        float,
        typer.Option("--watch-s", min=0.0, metavar="S", help="So long it is compared as a shadow."),
    ] = 5.0,
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Let a newly trained model take over while the operator moves, or return to the one before.

    Its recognizer comes up as a shadow of the active one, replays the last steps, is compared with
    it for a while, and is activated; the old one leaves then. All of it belongs to the `hmcs up` of
    --folder.
    """
    from hmcs_local import deploying
    from hmcs_local.connecting import open_operator
    from hmcs_local.control import Control
    from hmcs_local.interrupts import interruptible
    from hmcs_local.swap import PartlySwappedError

    if (model is None) != back:
        raise UserError("name either a model file or --back")
    control = Control(folder)
    with interruptible(), open_operator(router, cell, secure) as bus:
        try:
            if model is None:
                typer.echo(f"back to {deploying.back(bus, control, folder, typer.echo)}")
            else:
                deploying.deploy(bus, control, folder, model, watch_s=watch_s, tell=typer.echo)
        except PartlySwappedError as error:
            typer.echo(f"what was active before goes on, too: {error}", err=True)
            raise typer.Exit(1) from None


@app.command()
def router(
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT",
            help=f"Where it listens; what --config names by default, or {DEFAULT_ROUTER}.",
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A Zenoh json5 file, for TLS, access, …")
    ] = None,
    open_to_network: _Open = False,
) -> None:
    """Run a router alone, until Ctrl-C. It is reached from this machine only, unless told to."""
    from hmcs.bus.router import main as run_router

    words = ["--listen", listen] if listen else []
    words += ["--config", str(config)] if config else []
    words += ["--open-to-network"] if open_to_network else []
    raise typer.Exit(run_router(words))


@app.command()
def train(
    task: Annotated[str, typer.Argument(help="A shipped task's name or a task file.")],
    demonstrations: Annotated[
        list[str],
        typer.Argument(
            help="CSV files, MCAP recordings, lasa:SHAPE/NUMBER, lasa:SHAPE/FIRST-LAST."
        ),
    ],
    output: Annotated[Path, typer.Option(metavar="MODEL", help="The model file to write.")],
    name: Annotated[
        str | None, typer.Option(help="The model's name on the bus; the task's by default.")
    ] = None,
    recognizer: Annotated[
        str, typer.Option(metavar="KIND", help="What to learn for; see `hmcs recognizers`.")
    ] = "segment-filter",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A setting of the recognizer."),
    ] = None,
    choices: Annotated[
        list[str] | None,
        typer.Option(
            "--choose",
            metavar="NAME=A,B,…",
            help="Choose a setting by what it is worth on demonstrations left out.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of what is drawn at random in learning.")] = 0,
    find_states: Annotated[
        bool,
        typer.Option(
            "--find-states",
            help="Find gestemes and states in the motion itself, whatever labels it has.",
        ),
    ] = False,
    report: Annotated[
        bool, typer.Option(help="Write a page beside the model on what it is worth.")
    ] = True,
    accept_implausible: Annotated[
        bool,
        typer.Option(
            "--accept-implausible",
            help="Learn even from what no hand seems to have made: jumps, other units.",
        ),
    ] = False,
) -> None:
    """Learn a model of a task from demonstrations: CSV files, recordings, or human drawings.

    The page tells how each demonstration is recognized by a model of the others, which states are
    taken for each other, how far demonstrations lay apart, and what would help. States that are
    found stand as labels beside each recording and as a task file, MODEL with the ending .yaml.
    """
    from hmcs_local.progress import fits_shown
    from hmcs_trainer.training import train as learn

    alternatives = {name: value.split(",") for name, value in map(_setting, choices or [])}
    with fits_shown(bool(alternatives)) as fits:
        model = learn(
            task,
            demonstrations,
            output,
            name=name,
            recognizer=recognizer,
            settings=dict(map(_setting, settings or [])),
            choices=alternatives,
            seed=seed,
            find_states=find_states,
            report=output.with_suffix(".html") if report else None,
            accept_implausible=accept_implausible,
            progress=typer.echo,
            fits=fits,
        )
    typer.echo(f"{output}: model {model.name} for the recognizer {model.recognizer}")


@app.command()
def cancel(router: _Router = DEFAULT_ROUTER, cell: _Cell = "demo", secure: _Secure = None) -> None:
    """Let every trainer of a cell give up what it was asked to train; no model is written.

    The exit code is 0 where each one has done it, else 1.
    """
    from hmcs.bus.messages import Ask
    from hmcs.bus.verbs import CANCEL
    from hmcs_local.asking import ask_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = ask_everybody(bus, CANCEL, Ask(), timeout_s=5.0)
    raise typer.Exit(_told(replies))


@app.command()
def devices() -> None:
    """List input devices: which are here, which are missing, and what to do about it.

    The exit code is 0 where one is ready, else 1.
    """
    from hmcs_local.devices import show_devices

    raise typer.Exit(0 if show_devices(Console()) else 1)


@app.command()
def record(
    name: Annotated[str, typer.Argument(help="Of the file; by date and time if none.")] = "",
    stop: Annotated[bool, typer.Option("--stop", help="End the recording.")] = False,
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
) -> None:
    """Let every recorder begin a recording, or end it.

    The exit code is 0 where each one has done it, else 1.
    """
    from hmcs.bus.messages import Record
    from hmcs.bus.verbs import RECORD
    from hmcs_local.asking import ask_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = ask_everybody(bus, RECORD, Record(on=not stop, name=name))
    raise typer.Exit(_told(replies))


@app.command()
def mark(
    state: Annotated[
        str, typer.Argument(help="A state of the task; none ends what was marked.")
    ] = "",
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
) -> None:
    """Say which part of the task the hand is in from now on; the recorder writes it down."""
    from hmcs_local.connecting import open_operator
    from hmcs_local.marking import mark as say

    with open_operator(router, cell, secure) as bus:
        typer.echo(say(bus, state))


@app.command()
def stop(router: _Router = DEFAULT_ROUTER, cell: _Cell = "demo", secure: _Secure = None) -> None:
    """Let every robot stand, until its operator lets go and takes hold again.

    An operator that is played or simulated waits for `hmcs play`. All robots are asked at once. The
    exit code is 0 where every one that is present says that it stands, else 1.
    """
    from hmcs_local.asking import stop_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = stop_everybody(bus)
    raise typer.Exit(_told(replies))


@app.command()
def play(router: _Router = DEFAULT_ROUTER, cell: _Cell = "demo", secure: _Secure = None) -> None:
    """Let an operator that is played or simulated begin, or go on where it let go for a stop.

    The exit code is 0 where every input device has done it, else 1.
    """
    from hmcs.bus.messages import Ask
    from hmcs.bus.verbs import PLAY
    from hmcs_local.asking import ask_everybody
    from hmcs_local.connecting import open_operator

    with open_operator(router, cell, secure) as bus:
        replies = ask_everybody(bus, PLAY, Ask())
    raise typer.Exit(_told(replies))


@app.command()
def inspect(
    recording: Annotated[Path, typer.Argument(help="An MCAP file of the recorder.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one line of JSON.")] = False,
) -> None:
    """Show what a recording holds, channel by channel, and what is missing.

    A file that was cut off is read as far as it goes. The exit code is 0 where nothing is missing,
    else 1.
    """
    from hmcs_local.recordings import show_inspection

    whole = show_inspection(recording, Console(soft_wrap=True), as_json=as_json)
    raise typer.Exit(0 if whole else 1)


@app.command()
def label(
    recording: Annotated[Path, typer.Argument(help="An MCAP file of the recorder.")],
    sets: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="BEGIN-END=STATE",
            help="Label a stretch, in seconds, e.g. 1.2-3.9=take; may be repeated.",
        ),
    ] = None,
    clear: Annotated[
        bool, typer.Option("--clear", help="Take all labels away, before any --set.")
    ] = False,
    task: Annotated[
        str, typer.Option(help="Labels must be states of it: a shipped task's name or a file.")
    ] = "",
) -> None:
    """Show which part of the task each moment of a recording was, or say it afterwards.

    What is set stands in NAME.labels.csv beside the recording, which is never changed.
    """
    from hmcs.task import load_task
    from hmcs_local.labeling import label_recording

    label_recording(
        recording,
        sets or [],
        clear=clear,
        task=load_task(task) if task else None,
        console=Console(soft_wrap=True),
    )


@app.command()
def export(
    recording: Annotated[Path, typer.Argument(help="An MCAP file of the recorder.")],
    to: Annotated[Path, typer.Option(metavar="DIR", help="The folder the files are written to.")],
    form: Annotated[
        str, typer.Option("--format", metavar="csv|npz", help="Tables, or NumPy arrays.")
    ] = "csv",
) -> None:
    """Write a recording as a CSV file, or a file of NumPy arrays, for every channel."""
    from hmcs_local.recordings import export_recording

    if form not in ("csv", "npz"):
        raise UserError(f"--format {form}: expected csv or npz")
    export_recording(
        recording, to, "csv" if form == "csv" else "npz", Console(highlight=False, soft_wrap=True)
    )


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="An MCAP file of the recorder.")],
    model: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Another model; by default the one kept with it."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write every step as a CSV file.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw both over time; .png or .svg."),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Through the live stack, in place of its input device.")
    ] = False,
    rate: Annotated[
        float, typer.Option(metavar="R", min=0.01, max=100.0, help="So many times as fast, live.")
    ] = 1.0,
    task: Annotated[
        str, typer.Option(help="Of the live input device: a shipped task's name or a task file.")
    ] = "human-shapes",
    as_json: Annotated[bool, typer.Option("--json", help="Print one line of JSON.")] = False,
    router: _Router = DEFAULT_ROUTER,
    cell: _Cell = "demo",
    secure: _Secure = None,
) -> None:
    """Let a recorded operator move again: in process beside what was believed then, or live.

    In process, a recognizer of the model believes anew, and the fixture does what it would have
    done by that: an open loop, in which hand and robot are where they were recorded and react to
    nothing. Both stand beside what was recorded.

    --json: `steps`, those of them `degraded` (believed without all evidence live), the others
    `compared`, `same_bits` `agreement` `later_steps` of their beliefs; shares right by
    the labels `replayed_right` `recorded_right`; `times_real` as fast as it happened; of the
    fixture, over its ticks with a recorded one, `fixture_ticks` `_compared`, mean |Δk|
    `_factor_apart`, shares `_factor_close` (within 0.02) `_same_state` `_guides_both`
    `_guides_recorded_only` `_guides_replayed_only`, `_directions_apart_deg`,
    `_velocities_apart_mm_s` (RMS), `_recorded_off_guide_mm` `_replayed_off_guide_mm`, how often and
    how much later it takes hold and lets go `_recorded_takes_hold` `_replayed_takes_hold`
    `_takes_hold_later_ms` `_recorded_lets_go` `_replayed_lets_go` `_lets_go_later_ms`,
    `_times_real`; `notes` on what is missing. null where there is nothing to measure.
    """
    from hmcs_local.connecting import reached
    from hmcs_local.replays import Files, replay_in_process, replay_live

    if live:
        to = reached("input_device", router, cell, secure)
        raise typer.Exit(replay_live(recording, rate, task, to))
    console = Console(soft_wrap=True)
    replay_in_process(recording, model, Files(out, picture), console, as_json=as_json)


@app.command()
def recognizers(
    name: Annotated[
        str | None, typer.Argument(help="Show this one with its settings and their defaults.")
    ] = None,
) -> None:
    """List the recognizers a model can be learned for, with a line and the source of each."""
    from hmcs.recognition.registry import kind_named, kinds
    from hmcs_local.recognizers import show_kind, show_kinds

    if name is None:
        show_kinds(kinds(), Console())
    else:
        show_kind(kind_named(name), Console())


@app.command()
def study(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which study; without it all are listed.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Equal seeds measure the same.")] = 1,
    trials: Annotated[
        int | None, typer.Option(metavar="N", help="How many; the study's own number by default.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Processes; one a processor by default.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a setting; may be repeated."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one line of JSON.")] = False,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler to run on.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the result; .png or .svg.")
    ] = None,
) -> None:
    """Measure what recognition and assistance are worth: methods side by side on the same data."""
    from hmcs_laboratory.command import list_studies, run_study

    if name is None:
        raise typer.Exit(list_studies())
    raise typer.Exit(
        run_study(
            name,
            seed=seed,
            trials=trials,
            workers=workers,
            assignments=settings or (),
            as_json_line=json,
            cluster=cluster,
            picture=picture,
        )
    )


@app.command()
def figures(
    fast: Annotated[bool, typer.Option("--fast", help="With fewer trials and settings.")] = False,
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder pictures and page are written to.")
    ] = Path("out/figures"),
    seed: Annotated[int, typer.Option(help="Equal seeds make the same figures.")] = 1,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Processes; one a processor by default.")
    ] = None,
    only: Annotated[
        str, typer.Option(metavar="NUMBERS", help="These alone, e.g. 2.6,4.12; all if none.")
    ] = "",
) -> None:
    """Make the figures of the thesis anew, with a page that tells what came out of each."""
    from hmcs_laboratory.command import numbers_of, run_figures

    raise typer.Exit(
        run_figures(output, numbers=numbers_of(only), fast=fast, seed=seed, workers=workers)
    )


@task_app.command()
def check(
    file: Annotated[str, typer.Argument(help="A task file, or a shipped task's name.")],
    demonstrations: Annotated[
        list[str] | None,
        typer.Argument(help="CSV files, or lasa:SHAPE/NUMBER: whether they fit it and agree."),
    ] = None,
) -> None:
    """Name every problem of a task file, with line and field; exit code 2 where there is one.

    Demonstrations are judged as by `hmcs train`: what it would refuse ends with exit code 2.
    """
    from hmcs.fixtures.regions.workspace import check_workspace
    from hmcs.task import load_task
    from hmcs_trainer.training import checked

    task = load_task(file)
    check_workspace(file, task)
    shown = ""
    if demonstrations:
        count, told = checked(task, demonstrations, typer.echo)
        shown = f"; {count} demonstrations agree" + (
            ", apart from the findings above" if told else ""
        )
    counts = f"{len(task.gestemes)} gestemes, {len(task.states)} states"
    typer.echo(f"{file}: in order: {counts}{shown}")


@app.command()
def demo(
    output: Annotated[
        Path, typer.Option(metavar="DIR", help="The folder the report is written to.")
    ] = Path("out/demo"),
    seed: Annotated[int, typer.Option(help="Chooses which classifier is killed, and when.")] = 1,
    held_out: Annotated[
        str, typer.Option(metavar="N,N", help="The demonstrations played, and not learned from.")
    ] = "6,7",
) -> None:
    """Run the whole stack on held-out human motion, swap a classifier, write a report."""
    numbers = _numbers(held_out)
    from hmcs_local.demo import run_demo

    raise typer.Exit(run_demo(output=output, seed=seed, held_out=numbers))


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


def _told(replies: Replies) -> int:
    """Tell what each has done, and on stderr who has not; return the exit code."""
    from hmcs_local.asking import left_out

    for reply in replies.each:
        typer.echo(str(reply), err=not reply.done)
    if remark := left_out(replies.strangers):
        typer.echo(remark, err=True)
    return 0 if replies.all_done else 1


def _scale(item: str) -> tuple[str, int]:
    name, _, count = item.partition("=")
    if not count.isdecimal():
        raise UserError(f"--scale {item}: write SERVICE=N, e.g. gesteme-classifier=3")
    return name, int(count)


def _setting(item: str) -> tuple[str, str]:
    name, equals, value = item.partition("=")
    if not (name and equals):
        raise UserError(f"--set {item}: write NAME=VALUE, e.g. temperature=3")
    return name, value


def _numbers(text: str) -> tuple[int, ...]:
    if not all(part.strip().isdecimal() for part in text.split(",")):
        raise UserError(f"--held-out {text}: write numbers with commas between them, e.g. 6,7")
    return tuple(int(part) for part in text.split(","))


_STYLES = ("cyan", "green", "magenta", "yellow", "blue", "bright_cyan", "bright_green")


def _line(who: str, what: str) -> Text:
    style = "bold" if who == "hmcs" else _STYLES[sum(who.encode()) % len(_STYLES)]
    head = f"{who:22} | "
    return Text.assemble((head, style), what.replace("\n", f"\n{'':22} | "))


if __name__ == "__main__":
    main()
