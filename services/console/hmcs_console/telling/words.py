"""What the page says in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import PurePath

from hmcs import process_words
from hmcs.bus.keys import Member
from hmcs.bus.messages import Belief, FixtureState, Health, RobotState, TrainingProgress
from hmcs.palette import STATE_COLORS
from hmcs.process_words import ILL, LATE, LOST, NOBODY, OK, REFUSED, detail, process_name, well
from hmcs.recognizer_takeover import Agreement
from hmcs.shown import Markdown, colored_dot, linked
from hmcs_console.seeing.marking import Marking
from hmcs_console.seeing.reports import address_of
from hmcs_console.seeing.shelf import Shelved
from hmcs_console.shapes.palette import color_of, css

RECORDING = "#d00000"
MOST_NAMES = 12
"""Of a list of names so many are written out."""
_ROWS = Markdown("\n")
_HEAD = Markdown("| process | | {} | {} | {} |\n|---|---|---|---|---|").format(LOST, REFUSED, LATE)
_LINES, _PARAGRAPHS = Markdown("  \n"), Markdown("\n\n")
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


def several(names: Sequence[str]) -> Markdown:
    """Return names, the first of many, with how many more there are."""
    listed = Markdown(", ").join(names[:MOST_NAMES])
    more = len(names) - MOST_NAMES
    return Markdown("{} and {} more").format(listed, more) if more > 0 else listed


def why(belief: Belief | None, states: Sequence[str] = ()) -> Markdown:
    """Return what is recognized, and what that stands on."""
    if belief is None or not belief.states:
        return Markdown("**Nothing is recognized**: no recognizer has said anything yet.")
    lines = [
        Markdown("{} **{}** {:.0%}, unknown {:.0%}").format(
            colored_dot(css(color_of(belief.likely_state, states))),
            belief.likely_state,
            belief.confidence,
            belief.unknown,
        ),
        Markdown("gesteme {}, since step {} of {}").format(
            belief.likely_gesteme or "—", belief.segment_start, belief.step
        ),
        Markdown("log likelihood {:+.2f} nats, over the last steps {:+.2f}").format(
            belief.log_likelihood, belief.mean_log_likelihood
        ),
    ]
    if belief.unknown_alarm:
        lines.append(Markdown("**alarm**: the last steps fit no part of the task"))
    if belief.missing_gestemes:
        missing = several(belief.missing_gestemes)
        lines.append(Markdown("**missing**: no evidence of {}").format(missing))
    return _LINES.join(lines)


def doing(fixture: FixtureState | None, robot: RobotState | None) -> Markdown:
    """Return what fixture and robot do, and why."""
    return _LINES.join([*_fixture(fixture), *_robot(robot)])


def recognizers(
    active: str, agreement: Mapping[str, Agreement], *, nobody_runs_it: bool = False
) -> Markdown:
    """Return who is followed, whether anybody runs it, and how the others agree."""
    lines = [Markdown("follows **{}**").format(active or "no recognizer")]
    if nobody_runs_it:
        lines = [
            Markdown("**{}**: start one, or activate another").format(process_words.unrun(active))
        ]
    for name, agreed in agreement.items():
        if agreed.compared:
            line = Markdown("{} agrees in {:.0%} of {} steps")
            lines.append(line.format(name, agreed.same / agreed.compared, agreed.compared))
        else:
            lines.append(Markdown("{} has no step in common with it yet").format(name))
    return _LINES.join(lines)


def recording(path: str) -> Markdown:
    """Return that something is being recorded, and to which file; nothing where it is not."""
    if not path:
        return Markdown("")
    name = path.rpartition("/")[2]
    return Markdown("{} **recording** to {}").format(colored_dot(RECORDING), name)


def operating() -> Markdown:
    """Return how to operate."""
    return Markdown(
        "**Engage**: take the handle at the tool with the mouse; holding it is the dead-man's "
        "switch. **Let go**, and the robot stands. **Clutch** (C): the handle moves and the robot "
        "does not, to reach farther. **Stop** (S): every robot stands until its "
        "operator lets go and takes hold again. **Keep to** and **Scale** hold from when the "
        "handle is next taken."
    )


def services(health: Mapping[Member, Health | None], unrun: str = "") -> Markdown:
    """Return how every process is that is there, and which recognizer is followed unrun.

    A table of what was counted, then what each does; those that are ill come first.
    """
    if not health:
        return Markdown("{}").format(NOBODY)
    ordered = sorted(health.items(), key=lambda each: well(each[1]) == OK)
    rows = [_ROWS.join([_HEAD, *(_row(*each) for each in ordered)])]
    if unrun:
        line = Markdown("**The fixture {}.**").format(process_words.unrun(unrun))
        rows.insert(0, line)
    return _PARAGRAPHS.join([*rows, *(_doing(*each) for each in ordered)])


def training(progress: TrainingProgress | None, models: Iterable[Shelved] = ()) -> Markdown:
    """Return how far a training is, with the report of what was trained, where it is served."""
    if progress is None:
        return Markdown("No training was heard of.")
    text = Markdown("**{}** {}: {}").format(progress.model, progress.stage, progress.detail)
    report = Markdown("")
    if progress.report:
        name = PurePath(progress.report).stem
        served = any((model.name, model.report) == (progress.model, name) for model in models)
        shown = linked(progress.report, address_of(name)) if served else progress.report
        report = Markdown("report: {}").format(shown)
    return _LINES.join([line for line in (text, progress.path, report) if line])


def marking(now: Marking) -> Markdown:
    """Return which part of the task is marked, and what the pedal would mark."""
    marked = Markdown("nothing is marked")
    if now.now:
        marked = Markdown("now **{}**").format(now.now)
    if not now.by_pedal:
        return marked
    if now.order is None:
        text = Markdown("{}; which part is next nobody knows: give the console a task")
        return text.format(marked)
    if not now.next:
        return Markdown("{}; the pedal (key P) ends the task").format(marked)
    return Markdown("{}; the pedal (key P) begins **{}**").format(marked, now.next)


def _fixture(fixture: FixtureState | None) -> Iterable[Markdown]:
    if fixture is None:
        yield Markdown("**No fixture controller** is heard.")
        return
    yield Markdown("**{} law** {}").format(fixture.law, _REASONS[fixture.reason])
    yield Markdown("factor {:.2f}, compliance {:.2f}, {}").format(
        fixture.factor, fixture.compliance, "engaged" if fixture.engaged else "not engaged"
    )
    if fixture.off_guide_m is not None:
        yield Markdown("{:.0%} along {}, {:.1f} mm beside it").format(
            fixture.progress, fixture.gesteme or "the guide", fixture.off_guide_m * 1e3
        )
    if fixture.asks_for_help:
        yield Markdown("**its plan is stuck: help it on**")


def _robot(robot: RobotState | None) -> Iterable[Markdown]:
    if robot is None:
        yield Markdown("**No robot** is heard.")
        return
    yield Markdown("{} {}").format(robot.robot, _standing(robot))
    if robot.nearest_distance_m is not None:
        yield Markdown("{:.0f} mm from {}").format(
            robot.nearest_distance_m * 1e3, robot.nearest_obstacle
        )
    if robot.contacts:
        yield Markdown("**touches** {}").format(several(robot.contacts))


def _standing(robot: RobotState) -> Markdown:
    if robot.stop == "asked":
        return Markdown("**stands**: asked to, until its operator lets go and takes hold again")
    if robot.stop != "none":
        return Markdown("**stands**: {}").format(robot.stop.replace("_", " "))
    if robot.limited:
        return Markdown("follows, limited by {}").format(several(robot.limited))
    return Markdown("follows")


def _row(member: Member, health: Health | None) -> Markdown:
    shown = colored_dot(STATE_COLORS[2] if well(health) == OK else RECORDING)
    counts: Sequence[object] = ("", "", "")
    if health is not None:
        counts = [sum(each.values()) for each in (health.lost, health.refused, health.late)]
    cells = Markdown(" | ").join(Markdown("{}").format(count) for count in counts)
    return Markdown("| {} | {}\u00a0{} | {} |").format(
        process_name(member), shown, well(health), cells
    )


def _doing(member: Member, health: Health | None) -> Markdown:
    ill = Markdown("") if well(health) == OK else Markdown("{}: ").format(ILL)
    return Markdown("**{}**: {}{}").format(process_name(member), ill, detail(health))
