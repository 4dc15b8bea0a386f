"""What a task asks of its fixture in each of its states, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from hmcs.fixtures.controller.rules import Rules, rules_of
from hmcs.shown import Markdown, colored_dot
from hmcs.task import Task
from hmcs.task.fixture_parts import VolumeSetup
from hmcs_console.shapes.palette import color_of, css

_HEAD = Markdown("| state | law, compliance | up to k | tube, mm | leads |\n|---|---|---|---|---|")


def rules(task: Task | None, state_now: str) -> Markdown:
    """Return law, compliance, maximum factor k, volume and aim of every state of a task.

    The state of the moment is in bold.
    """
    if task is None:
        return Markdown("The model that is followed is not known here.")
    every = rules_of(task)
    names = [state.name for state in task.states]
    rows = [
        _row(state.name, names, every.in_state(state.name), state.name == state_now)
        for state in task.states
    ]
    name = Markdown("**{}**").format(task.name)
    return Markdown("\n").join([name, Markdown(""), _HEAD, *rows])


def _row(state: str, states: Sequence[str], rules: Rules, now: bool) -> Markdown:
    cells = (
        state,
        f"{rules.fixture.law}, {_compliance(rules)}",
        f"{rules.fixture.maximum_factor:.2f}",
        _volume(rules.fixture.volume),
        _aim(rules),
    )
    cell = Markdown("**{}**" if now else "{}")
    shown = Markdown(" | ").join(map(cell.format, cells))
    return Markdown("| {}\u00a0{} |").format(colored_dot(css(color_of(state, states))), shown)


def _compliance(rules: Rules) -> str:
    fixture = rules.fixture
    if fixture.compliance in ("fixed", "optimal"):
        return f"{fixture.compliance} {rules.fixed_compliance:.2f}"
    if fixture.compliance == "cue":
        return f"cue: {fixture.cue.cue}, {fixture.cue.scaling}"
    return fixture.compliance


def _volume(volume: VolumeSetup | None) -> str:
    if volume is None:
        return "none"
    knots = " → ".join(f"{knot.radius_m * 1e3:.0f}" for knot in volume.knots)
    at_knots = f"{knots} mm" if knots else ""
    if volume.of_spread is None:
        return at_knots
    spread = f"{volume.of_spread:g} × spread"
    return f"{spread}, at least {at_knots}" if knots else spread


def _aim(rules: Rules) -> str:
    if rules.target is not None:
        place = ", ".join(f"{value:.3f}" for value in rules.target.position)
        turned = "" if rules.target.orientation is None else ", and its turn"
        return f"to ({place}) m{turned}"
    if rules.plan is None:
        return "along the path"
    shared = "" if rules.shared is None else f"; {', '.join(rules.shared.operator_axes)} shared"
    return f"plan, {rules.plan.speed_m_s * 1e3:.0f} mm/s{shared}"
