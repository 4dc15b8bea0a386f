"""Which link of a description is the tool, and whether it can be led."""

from __future__ import annotations

from hmcs.arms.chain import Chain, chain_of
from hmcs.arms.urdf import Urdf, UrdfError

FEWEST_JOINTS = 6
"""A tool is commanded in six directions."""


def check_joints(urdf: Urdf, chain: Chain, tool_link: str, base_link: str | None) -> None:
    """Raise UrdfError for an arm that cannot follow a tool's velocity in every direction."""
    names, base = chain.joint_names, base_link or urdf.root
    if len(names) < FEWEST_JOINTS:
        raise UrdfError(
            f"{urdf.file}:{urdf.links[tool_link]}: between {base!r} and "
            f"{tool_link!r} there are {len(names)} joints that move ({', '.join(names)}), "
            f"expected {FEWEST_JOINTS} or more: a tool is commanded in six directions. Choose "
            "another tool_link or base_link"
        )


def tool_links(urdf: Urdf) -> tuple[str, ...]:
    """Return the links that may be a tool: with enough joints above, and nothing below or a name
    that tools have.
    """
    parents = {joint.parent for joint in urdf.joints.values()}
    candidates = []
    for link in urdf.links:
        usual = any(part in link.lower() for part in ("tool", "tcp", "ee_link", "flange", "grasp"))
        if link in parents and not usual:
            continue
        try:
            chain = chain_of(urdf, link)
        except UrdfError:
            continue
        if len(chain.joint_names) < FEWEST_JOINTS:
            continue
        candidates.append((not usual, link))
    return tuple(link for _, link in sorted(candidates, key=lambda each: each[0]))


def only_tool_link(urdf: Urdf) -> str:
    """Return the one link that may be the tool; raises UrdfError where there are more, or none."""
    candidates = tool_links(urdf)
    if len(candidates) == 1:
        return candidates[0]
    if not candidates:
        raise UrdfError(
            f"{urdf.file}: no link hangs on six or more joints that move (revolute, continuous or "
            "prismatic, one after another): expected an arm. Name another link as tool_link to "
            "read what is in its way"
        )
    raise UrdfError(
        f"{urdf.file}: which link is the tool? Give tool_link, one of: {', '.join(candidates)}"
    )
