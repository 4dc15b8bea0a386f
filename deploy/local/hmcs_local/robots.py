"""What an arm is like: its joints, its reach, its postures, what its file leaves out."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from hmcs.arms.tools import tool_links
from hmcs.errors import UserError
from hmcs.shown import plain
from hmcs.task import Task, load_task
from hmcs.task.values import unknown_name_message
from hmcs.write_places import check_file_place
from hmcs_local.tables import show_table
from hmcs_robot.description.checking import joint_rows, reach_of, tool_at
from hmcs_robot.description.described import (
    DescribedArm,
    check_follows,
    describe,
    joint_positions_text,
)
from hmcs_robot.description.picture import draw_arm
from hmcs_robot.robots import ROBOTS, RobotModel, model_of, ros_package_path

_TASK_FILES = (".yaml", ".yml")
_PICTURES = (".png", ".svg", ".pdf")
_COLUMNS = ("joint", "kind", "range", "speed", "effort", "assumed")
_LONGEST_LINE = 400


def check_robot(
    file: str,
    tool_link: str | None,
    base_link: str | None,
    package_path: tuple[Path, ...],
    output: Path | None,
    console: Console,
) -> None:
    """Show an arm and, where there is an `output`, draw it there.

    Raises UserError for an arm that cannot be used and a picture that cannot be written.
    """
    if output is not None and output.suffix.lower() not in _PICTURES:
        raise UserError(f"--output {output}: expected a name that ends in {', '.join(_PICTURES)}")
    if output is not None:
        check_file_place(output, "--output")
        if not output.parent.is_dir():
            raise UserError(f"--output {output}: there is no folder {output.parent}: make it first")
    for folder in package_path:
        if not folder.is_dir():
            raise UserError(f"--package-path {folder}: no such folder")
    model = _model(file)
    model = model._replace(
        tool_link=tool_link or model.tool_link,
        base_link=base_link or model.base_link,
        package_path=(*package_path, *model.package_path),
    )
    arm = describe(model)
    check_follows(arm)
    _show(arm, console)
    reach = reach_of(arm.chain)
    box = " × ".join(
        f"{axis} {lower:.2f} … {upper:.2f}"
        for axis, lower, upper in zip("xyz", reach.lower, reach.upper, strict=True)
    )
    _say(console, f"reach: {reach.farthest_m:.2f} m from the base; {box} m, base frame")
    for name, positions in {"home": arm.home, **arm.poses}.items():
        tool = tool_at(arm.chain, positions)
        _say(console, f"{name}: {joint_positions_text(positions)}")
        _say(
            console,
            f"  tool_start_m: {joint_positions_text(tool.position)}, "
            f"tool_orientation_xyzw: {joint_positions_text(tool.orientation)}",
        )
    if arm.notes:
        _say(console, "what the file leaves out:")
        for line in arm.told.splitlines():
            _say(console, f"  {line}")
    if output is not None:
        draw_arm(arm, reach, output)
        _say(console, f"drawn: {output}")


def check_own_robot(task: Task) -> list[str]:
    """Return what the file of a task's own arm leaves out, a line each.

    Raises UserError for an arm that cannot be used.
    """
    if task.robot.urdf is None:
        return []
    arm = describe(model_of(task.robot))
    check_follows(arm)
    return [plain(line, _LONGEST_LINE) for line in arm.told.splitlines()]


def show_robots(console: Console) -> None:
    """Show the robots that come along."""
    rows = []
    for name in sorted(ROBOTS):
        arm = describe(ROBOTS[name])
        reach_m = reach_of(arm.chain, 2000).farthest_m
        rows.append((name, str(len(arm.chain.joint_names)), f"{reach_m:.2f} m", arm.tool_link))
    show_table(console, "", ("robot", "joints", "reach", "tool link"), rows)


def _show(arm: DescribedArm, console: Console) -> None:
    base = arm.model.base_link or arm.urdf.root
    title = f"{arm.urdf.file}: from {base} to {arm.tool_link}"
    show_table(console, title, _COLUMNS, joint_rows(arm))
    if arm.chain.followers:
        _say(console, f"follow others: {', '.join(arm.chain.followers)}")
    if arm.chain.held:
        held = (f"{name} at {at:.4g}" for name, at in arm.chain.held.items())
        _say(console, f"held: {', '.join(held)}")
    others = [link for link in tool_links(arm.urdf) if link != arm.tool_link]
    if others:
        _say(console, f"other links that may be the tool: {', '.join(others)}")


def _model(file: str) -> RobotModel:
    if file in ROBOTS and not Path(file).exists():
        return ROBOTS[file]
    if Path(file).suffix.lower() in _TASK_FILES:
        return model_of(load_task(file).robot)
    if not Path(file).exists() and not Path(file).suffix:
        raise UserError(f"{unknown_name_message('robot', file, ROBOTS)}, or name a URDF file")
    return RobotModel(Path(file), None, package_path=ros_package_path())


def _say(console: Console, line: str) -> None:
    # What a file says is shown as text, not as marks of the terminal.
    console.print(plain(line, _LONGEST_LINE), markup=False, highlight=False, soft_wrap=True)
