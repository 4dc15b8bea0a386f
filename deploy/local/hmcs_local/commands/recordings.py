"""Make and use recordings: `record`, `mark`, `inspect`, `label`, `export`, `view`, `replay`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.errors import UserError
from hmcs.task.values import unknown_name_message
from hmcs.write_places import check_folder_place, check_new_folder_place
from hmcs_local.commands.options import Cell, Folder, Router, Secure, note
from hmcs_local.commands.replies import tell_replies
from hmcs_local.stack import DEFAULT_FOLDER
from hmcs_local.tables import screen

Recording = Annotated[
    Path,
    typer.Argument(
        help="An MCAP file of the recorder; its name alone where it lies among the recordings of "
        "`hmcs up`."
    ),
]
FORMATS = ("csv", "npz", "lerobot", "rosbag2")


def record(
    name: Annotated[str, typer.Argument(help="Of the file; by date and time if none.")] = "",
    stop: Annotated[bool, typer.Option("--stop", help="End the recording.")] = False,
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
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
    raise typer.Exit(tell_replies(replies))


def mark(
    state: Annotated[
        str, typer.Argument(help="A state of the task; none ends what was marked.")
    ] = "",
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
) -> None:
    """Say which part of the task the hand is in from now on; the recorder writes it down."""
    from hmcs_local.connecting import open_operator
    from hmcs_local.marking import mark as say

    with open_operator(router, cell, secure) as bus:
        typer.echo(say(bus, state))


def inspect(
    recording: Recording,
    as_json: Annotated[bool, typer.Option("--json", help="Print one line of JSON.")] = False,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Show what a recording holds, channel by channel, and what is missing.

    A file that was cut off is read as far as it goes. The exit code is 0 where nothing is missing,
    else 1.
    """
    from hmcs_local.recorded_files import recording_named
    from hmcs_local.recordings import show_inspection

    file = recording_named(recording, folder, note)
    whole = show_inspection(file, screen(), as_json=as_json)
    raise typer.Exit(0 if whole else 1)


def label(
    recording: Recording,
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
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Show which part of the task each moment of a recording was, or say it afterwards.

    What is set stands in NAME.labels.csv beside the recording, which is never changed.
    """
    from hmcs.task import load_task
    from hmcs_local.labeling import label_recording
    from hmcs_local.recorded_files import recording_named

    held_to = load_task(task) if task else None
    label_recording(
        recording_named(recording, folder, note),
        sets or [],
        clear=clear,
        task=held_to,
        console=screen(),
    )


def export(
    recording: Recording,
    to: Annotated[Path, typer.Option(metavar="DIR", help="The folder the files are written to.")],
    form: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="csv|npz|lerobot|rosbag2",
            help="Tables, NumPy arrays, a LeRobot data set of its demonstrations, a bag of ROS 2.",
        ),
    ] = "csv",
    fps: Annotated[
        int, typer.Option(metavar="HZ", min=1, max=1000, help="Frames a second, for lerobot.")
    ] = 30,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Write a recording for other programs.

    As CSV or as NumPy arrays a file for every channel; as `lerobot` (v2.1) or `rosbag2` (MCAP)
    one folder, which must not be there yet.
    """
    from hmcs_local.recorded_files import recording_named
    from hmcs_local.recordings import export_recording, export_to_others

    console = screen()
    match form:
        case "csv" | "npz":
            check_folder_place(to, "--to")
            export_recording(recording_named(recording, folder, note), to, form, console)
        case "lerobot" | "rosbag2":
            check_new_folder_place(to, "--to")
            export_to_others(recording_named(recording, folder, note), to, form, fps, console)
        case _:
            raise UserError(f"--format: {unknown_name_message('format', form, FORMATS)}")


def view(
    recording: Recording,
    rerun: Annotated[
        bool, typer.Option("--rerun", help="In Rerun's viewer; needs the extra hmcs[rerun].")
    ] = False,
    save: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Write what Rerun opens, on any machine."),
    ] = None,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Show a recording in space and over time: robot, ways, beliefs, states, forces, fixture.

    In Foxglove it opens as it is; see `hmcs export` for a layout.
    """
    from hmcs_local.recorded_files import recording_named
    from hmcs_local.viewing import check_save_place, save_for_rerun, show_in_rerun

    check_save_place(save)
    file, console = recording_named(recording, folder, note), screen()
    if not rerun:
        raise UserError(
            "name a viewer: --rerun; in Foxglove the recording opens as it is, with the layout "
            "that `hmcs export` writes"
        )
    if save is None:
        show_in_rerun(file, console)
    else:
        save_for_rerun(file, save, console)


def replay(
    recording: Recording,
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
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
    folder: Folder = DEFAULT_FOLDER,
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
    from hmcs.recognition.model_file import load_model
    from hmcs_local.connecting import reached
    from hmcs_local.recorded_files import recording_named
    from hmcs_local.replays import Files, check_files, replay_in_process, replay_live

    if live:
        to = reached("input_device", router, cell, secure)
        raise typer.Exit(replay_live(recording_named(recording, folder, note), rate, task, to))
    files = Files(out, picture)
    check_files(files)
    given = None if model is None else load_model(model)
    file = recording_named(recording, folder, note)
    replay_in_process(file, given, files, screen(), as_json=as_json)
