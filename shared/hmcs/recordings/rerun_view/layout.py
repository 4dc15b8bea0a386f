"""The arrangement of Rerun's views: space at the left, states and what they do at the right."""

from __future__ import annotations

from typing import Any

from hmcs.recordings.rerun_view.robot import BASE

OPERATOR, STATES, BELIEFS, FIXTURE, FORCES = "operator", "states", "beliefs", "fixture", "forces"
"""Of the entities in the operator's frame, and of those over time."""


def layout() -> Any:
    """Return the blueprint."""
    import rerun.blueprint as rrb

    space = rrb.Vertical(
        rrb.Spatial3DView(origin=BASE, name="Robot, base frame, m"),
        rrb.Spatial3DView(origin=OPERATOR, name="Hand, operator frame, m"),
        row_shares=[3, 2],
    )
    over_time = rrb.Vertical(
        rrb.StateTimelineView(origin=STATES, name="States"),
        rrb.TimeSeriesView(origin=BELIEFS, name="Belief, probability of each state"),
        rrb.TimeSeriesView(origin=FIXTURE, name="Fixturing factor and compliance, 0 to 1"),
        rrb.TimeSeriesView(origin=FORCES, name="Force, N"),
    )
    return rrb.Blueprint(rrb.Horizontal(space, over_time, column_shares=[3, 2]))
