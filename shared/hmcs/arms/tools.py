"""Which link of a description is the tool, and whether it can be led."""

from __future__ import annotations

import numpy as np

from hmcs.arms.chain import Chain, chain_of
from hmcs.arms.inverses import FEWEST, FULL
from hmcs.arms.urdf import Urdf, UrdfError
from hmcs.arrays import Array

_LEAST_M_PER_RAD = 0.01
"""An arm whose tool moves less in some direction, in a comfortable posture, cannot be led."""


def check_joints(
    urdf: Urdf, chain: Chain, tool_link: str, base_link: str | None, home: Array | None = None
) -> None:
    """Raise UrdfError for an arm that cannot follow its tool's velocity in every direction.

    At `home`, rad or m, shape (n,), it is also tried whether the joints move it in all of them.
    """
    names, base = chain.joint_names, base_link or urdf.root
    where = f"{urdf.file}:{urdf.links[tool_link]}: "
    if len(names) < FEWEST:
        raise UrdfError(
            f"{where}between {base!r} and {tool_link!r} there are {len(names)} joints that "
            f"move ({', '.join(names)}), expected {FEWEST} or more: a tool is led in three "
            "directions. Choose another tool_link or base_link"
        )
    if home is None:
        return
    moves, lengths, _ = np.linalg.svd(chain.jacobians(home)[:3])
    if lengths[-1] < _LEAST_M_PER_RAD:
        along = ", ".join(f"{value:.2f}" for value in moves[:, -1])
        raise UrdfError(
            f"{where}the joints {', '.join(names)} do not move {tool_link!r} along "
            f"({along}) in {base!r}, so that it cannot be led in every direction: choose another "
            "tool_link, or an arm with a joint for it"
        )


def tool_links(urdf: Urdf) -> tuple[str, ...]:
    """Return the links that may be a tool: with nothing below or a name that tools have.

    They have six joints above them; three where no link has six.
    """
    return _tool_links(urdf, FULL) or _tool_links(urdf, FEWEST)


def _tool_links(urdf: Urdf, fewest: int) -> tuple[str, ...]:
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
        if len(chain.joint_names) < fewest:
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
            f"{urdf.file}: no link hangs on three or more joints that move (revolute, continuous "
            "or prismatic, one after another): expected an arm. Name another link as tool_link to "
            "read what is in its way"
        )
    raise UrdfError(
        f"{urdf.file}: which link is the tool? Give tool_link, one of: {', '.join(candidates)}"
    )
