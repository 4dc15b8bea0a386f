"""URDFs written for tests: an arm of six joints, and what may be changed of it."""

from __future__ import annotations

from pathlib import Path

LIMIT = '<limit lower="-2.8" upper="2.8" effort="200" velocity="2"/>'
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
"""Of an arm with a spherical wrist that points along x."""
OFFSETS = ("0 0 0.3", "0 0 0.2", "0 0 0.4", "0.2 0 0", "0.2 0 0", "0.06 0 0")


def link(name: str, mass_kg: float = 0.5) -> str:
    """Return a link that weighs as a ball and has a small shape."""
    return (
        f'<link name="{name}"><inertial><mass value="{mass_kg}"/>'
        '<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
    )


def joint(
    name: str,
    parent: str,
    child: str,
    kind: str = "revolute",
    axis: str = "0 0 1",
    xyz: str = "0 0 0",
    more: str = LIMIT,
) -> str:
    """Return a joint."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def arm(changes: dict[int, str] | None = None, more: str = "") -> str:
    """Return the lines of an arm from `base` to `tool`; joints by their number may be others."""
    lines = ['<robot name="own">', link("base")]
    for k, (axis, xyz) in enumerate(zip(AXES, OFFSETS, strict=True), 1):
        parent, child = ("base" if k == 1 else f"l{k - 1}"), f"l{k}"
        own = (changes or {}).get(k, joint(f"j{k}", parent, child, axis=axis, xyz=xyz))
        lines += [link(child), own]
    lines += [
        '<link name="tool"/>',
        joint("to_tool", "l6", "tool", "fixed", xyz="0.08 0 0", more=""),
        more,
        "</robot>",
    ]
    return "\n".join(lines) + "\n"


def written(folder: Path, text: str) -> Path:
    """Write a URDF; return its file."""
    file = folder / "own.urdf"
    file.write_text(text, encoding="utf-8")
    return file
