"""What the page says in words."""

from __future__ import annotations

from collections.abc import Mapping

from hmcs.bus.keys import Member
from hmcs.bus.messages import Belief, FixtureState, Health, RobotState, TrainingProgress
from hmcs_console.seeing.shadows import Agreement
from hmcs_console.teaching.marking import Marking

_REASONS = {
    "guiding": "guides: the state is recognized",
    "unsure": "gives way: no state is sure enough",
    "no_belief": "gives way: no recognizer has said anything yet",
    "belief_stale": "gives way: the recognizer is late",
    "belief_degraded": "gives way: evidence is missing",
    "unknown_motion": "gives way: the motion is no part of the task",
    "disengaged": "waits: the operator has let go",
    "input_stale": "waits: no operator's samples come in",
}


def why(belief: Belief | None) -> str:
    """Return what is recognized, and what that stands on."""
    if belief is None or not belief.states:
        return "**Nothing is recognized**: no recognizer has said anything yet."
    lines = [
        f"**{belief.likely_state}** {belief.confidence:.0%}, unknown {belief.unknown:.0%}",
        f"gesteme {belief.likely_gesteme or '—'}, since step {belief.segment_start} "
        f"of {belief.step}",
        f"log likelihood {belief.log_likelihood:+.2f} nats, "
        f"over the last steps {belief.mean_log_likelihood:+.2f}",
    ]
    if belief.unknown_alarm:
        lines.append("**alarm**: the last steps fit no part of the task")
    if belief.missing_gestemes:
        lines.append(f"**missing**: no evidence of {', '.join(belief.missing_gestemes)}")
    return "  \n".join(lines)


def doing(fixture: FixtureState | None, robot: RobotState | None) -> str:
    """Return what fixture and robot do, and why."""
    lines = []
    if fixture is None:
        lines.append("**No fixture controller** is heard.")
    else:
        lines += [
            f"**{fixture.law} law** {_REASONS[fixture.reason]}",
            f"factor {fixture.factor:.2f}, compliance {fixture.compliance:.2f}, "
            f"{'engaged' if fixture.engaged else 'not engaged'}",
        ]
        if fixture.off_guide_m is not None:
            lines.append(
                f"{fixture.progress:.0%} along {fixture.gesteme or 'the guide'}, "
                f"{fixture.off_guide_m * 1e3:.1f} mm beside it"
            )
        if fixture.asks_for_help:
            lines.append("**its plan is stuck: help it on**")
    if robot is None:
        lines.append("**No robot** is heard.")
    else:
        lines.append(f"{robot.robot} " + _standing(robot))
        if robot.nearest_distance_m is not None:
            lines.append(f"{robot.nearest_distance_m * 1e3:.0f} mm from {robot.nearest_obstacle}")
        if robot.contacts:
            lines.append(f"**touches** {', '.join(robot.contacts)}")
    return "  \n".join(lines)


def recognizers(active: str, agreement: Mapping[str, Agreement]) -> str:
    """Return who is followed, and how the others agree."""
    lines = [f"follows **{active or 'no recognizer'}**"]
    for name, agreed in agreement.items():
        if agreed.compared:
            share = agreed.same / agreed.compared
            lines.append(f"{name} agrees in {share:.0%} of {agreed.compared} steps")
        else:
            lines.append(f"{name} has no step in common with it yet")
    return "  \n".join(lines)


def operates(operator: str) -> str:
    """Return who operates."""
    if not operator:
        return "Nobody operates: drag the handle at the tool."
    return f"**{operator}** operates."


def operating() -> str:
    """Return how to operate."""
    return (
        "**Engage**: take the handle at the tool with the mouse; holding it is the dead-man's "
        "switch. **Let go**, and the robot stands. **Clutch** (C): the handle moves and the robot "
        "does not, to reach farther. **Stop** (S): every robot stands, whoever drives it, until "
        "its operator lets go and takes hold again. **Keep to** and **Scale** hold from when the "
        "handle is next taken."
    )


def services(health: Mapping[Member, Health | None]) -> str:
    """Return how every process is that is there."""
    if not health:
        return "Nobody is there."
    return "\n\n".join(_process(member, told) for member, told in health.items())


def training(progress: TrainingProgress | None) -> str:
    """Return how far a training is."""
    if progress is None:
        return "No training was heard of."
    written = f"  \n{progress.path}" if progress.path else ""
    return f"**{progress.model}** {progress.stage}: {progress.detail}{written}"


def _standing(robot: RobotState) -> str:
    if robot.stop == "asked":
        return "**stands**: asked to, until its operator lets go and takes hold again"
    if robot.stop != "none":
        return f"**stands**: {robot.stop.replace('_', ' ')}"
    return "follows" + (f", limited by {', '.join(robot.limited)}" if robot.limited else "")


def _process(member: Member, told: Health | None) -> str:
    name = f"**{member.service}** {member.instance}"
    if told is None:
        return f"{name}  \nhas not told how it is"
    lost, late, refused = (
        sum(counted.values()) for counted in (told.lost, told.late, told.refused)
    )
    return (
        f"{name}, {told.loop_rate_hz:.0f} Hz  \n"
        f"{'' if told.healthy else '**unhealthy**: '}{told.detail}  \n"
        f"lost {lost}, late {late}, refused {refused}"
    )


def marking(now: Marking) -> str:
    """Return which part of the task is marked, and what the pedal would mark."""
    marked = f"now **{now.now}**" if now.now else "nothing is marked"
    if not now.by_pedal:
        return marked
    if now.order is None:
        return f"{marked}; which part is next nobody knows: give the console a task"
    return f"{marked}; the pedal (key P) " + (
        f"begins **{now.next}**" if now.next else "ends the task"
    )
