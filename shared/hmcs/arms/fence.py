"""The forbidden regions of the robot's own task: it keeps its tool out of them by itself.

Whatever is commanded, and whichever process died: the planes that part the tool from what is
forbidden bound its motion at every control tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hmcs.arms.state import Pose
from hmcs.fixtures.regions.forbidden import NOTHING, Candidates, Region, clearance_m, nearby
from hmcs.fixtures.regions.tool_shape import PlacedTool, ToolShape


@dataclass(frozen=True)
class Fence:
    """Forbidden regions, and the tool that is kept out of them."""

    regions: Sequence[Region]
    tool: ToolShape
    reach_m: float
    """Within it regions are looked for: farther than the tool goes while it slows to a stand."""
    margin_m: float = 0.0005
    """The tool is kept so far off: what the arm's own control is short of ideal."""

    def planes(self, tool: Pose) -> Candidates:
        """Return the planes that bound the tool's motion now, distances less the margin."""
        if not self.regions:
            return NOTHING
        near = nearby(self.regions, self._placed(tool), self.reach_m)
        return near._replace(distances=near.distances - self.margin_m)

    def clearance_m(self, tool: Pose) -> float:
        """Return how far the tool is from the nearest region, exactly; negative inside."""
        return clearance_m(self.regions, self._placed(tool))

    def _placed(self, tool: Pose) -> PlacedTool:
        return PlacedTool(self.tool, tool.position, tool.orientation)
