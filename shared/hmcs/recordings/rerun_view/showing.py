"""The messages of a recording as entities of Rerun.

| of | entities |
|---|---|
| RobotState | `base/ROBOT/…`: links and joints; `base/tool`, `base/path`; `states/ROBOT stops` |
| Motion | `operator/hand`, `operator/path`; `forces/operator x`… where the device has them |
| FixtureState | `fixture/…`; `forces/fixture x`…; `base/guidance`; `states/fixture` |
| Belief | `beliefs/MODEL/STATE`, `states/believed by MODEL` |
| labels | `states/labeled` |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hmcs.bus.keys import recognizer_in
from hmcs.bus.messages import Belief, FixtureState, Motion, RobotState
from hmcs.errors import UserError
from hmcs.palette import UNKNOWN_COLOR, state_color
from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.rerun_view.layout import BELIEFS, FIXTURE, FORCES, OPERATOR, STATES, layout
from hmcs.recordings.rerun_view.paths import EVERY_NS, ColoredPath, color_numbers
from hmcs.recordings.rerun_view.robot import BASE, DrawnRobot
from hmcs.recordings.rerun_view.rows import Rows, entity, listed

APPLICATION = "hmcs"
GUIDANCE_M = 0.1
"""Length of the arrow along the preferred direction at a fixturing factor of 1."""
AXES_M = 0.05
"""Length of the axes at hand and tool."""
TOLD_EVERY = 500
"""Messages."""
_JOINTS = "joints/"
"""Metadata of this beginning and a robot's name say what its description calls its joints."""


def new_stream(content: RecordingContent) -> Any:
    """Return a stream to Rerun named after a recording, which goes nowhere yet.

    Raises MissingLibraryError without `rerun-sdk`.
    """
    try:
        import rerun as rr
    except ImportError as error:
        why = "Rerun shows it by rerun-sdk, which is not here"
        raise missing("rerun", why) from error
    stream = rr.RecordingStream(APPLICATION, recording_id=content.path.stem)
    stream.send_recording_name(content.path.stem)
    return stream


def rerun_file(
    content: RecordingContent, progress: Callable[[int, int], None]
) -> tuple[bytes, tuple[str, ...]]:
    """Return a recording as the content of a file of Rerun's (.rrd), and notes as `show` does.

    Made in memory: where Rerun itself writes to a disk that is full, it waits without end. Raises
    as `show` does.
    """
    stream = new_stream(content)
    written = stream.binary_stream()
    stream.send_blueprint(layout())
    notes = show(content, stream, progress)
    # Each time it is read it ends with an index of its own, and a file has one.
    data = written.read()
    stream.disconnect()
    return data, notes


def show(
    content: RecordingContent, stream: Any, progress: Callable[[int, int], None]
) -> tuple[str, ...]:
    """Send all that is shown of a recording; return what cannot be shown, a line each.

    `progress` is given how many messages of all are gone over. Raises RecordingError for a
    recording with nothing to show, and as reading and `labels_of` do.
    """
    kinds = (Motion, RobotState, FixtureState, Belief)
    shown = _Shown(content, stream)
    count = 0
    for count, (recorded, _, message) in enumerate(content.of_any(*kinds), start=1):
        if count % TOLD_EVERY == 0:
            progress(count, len(content.messages))
        match message:
            case Motion():
                shown.motion(message, recorded.log_ns)
            case RobotState():
                shown.robot(message, recorded.log_ns)
            case FixtureState():
                shown.fixture(message, recorded.log_ns)
            case Belief():
                shown.belief(recognizer_in(recorded.key).model, message, recorded.log_ns)
            case _:
                pass
    if not count:
        raise RecordingError(f"{content.path}: has no motion, no robot and no belief to show")
    shown.finish()
    return tuple(shown.notes)


class _Shown:
    """What was seen so far, as far as what comes next is shown by it."""

    def __init__(self, content: RecordingContent, stream: Any) -> None:
        self.notes: list[str] = []
        self._content, self._stream = content, stream
        self._rows = Rows(stream)
        self._robots: dict[str, DrawnRobot | None] = {}
        self._drawn_ns: dict[str, int] = {}
        self._named: set[str] = set()
        self._hand, self._tool = ColoredPath(), ColoredPath()
        self._tool_position = [0.0, 0.0, 0.0]
        self._last: dict[str, str] = {}
        self._color, self._colors = UNKNOWN_COLOR, dict[str, str]()
        self._active = ""
        self._axes(OPERATOR, "hand")
        self._axes(BASE, "tool")

    def motion(self, motion: Motion, log_ns: int) -> None:
        """Show the hand."""
        import rerun as rr

        if motion.dead_man and not motion.clutch:
            self._hand.add(motion.position, self._color, log_ns)
        else:
            self._hand.interrupt()
        if motion.wrench is not None:
            self._force("operator", motion.wrench, log_ns)
        if not self._is_due("hand", log_ns):
            return
        turned = [0.0, 0.0, 0.0, 1.0] if motion.orientation is None else motion.orientation
        self._rows.add(
            entity(OPERATOR, "hand"),
            rr.Transform3D,
            log_ns,
            translation=listed(motion.position),
            quaternion=listed(turned),
        )

    def robot(self, state: RobotState, log_ns: int) -> None:
        """Show the robot and its tool."""
        import rerun as rr

        self._state(f"{state.robot} stops", "" if state.stop == "none" else state.stop, log_ns)
        self._tool.add(state.tool_position, self._color, log_ns)
        self._tool_position = [*listed(state.tool_position)]
        if not self._is_due(f"robot {state.robot}", log_ns):
            return
        self._rows.add(
            entity(BASE, "tool"),
            rr.Transform3D,
            log_ns,
            translation=self._tool_position,
            quaternion=listed(state.tool_orientation),
        )
        drawn = self._drawn(state.robot)
        if drawn is not None:
            facts = self._content.metadata.get(f"{_JOINTS}{state.robot}", {})
            names = state.joint_names or facts.get("joints", "").split()
            positions = dict(zip(names, listed(state.joint_positions), strict=False))
            drawn.move(self._rows, log_ns, positions)

    def fixture(self, state: FixtureState, log_ns: int) -> None:
        """Show what the fixture does."""
        import rerun as rr

        self._active = state.model
        self._state(FIXTURE, state.state, log_ns)
        self._scalar((FIXTURE, "factor"), state.factor, log_ns)
        self._scalar((FIXTURE, "compliance"), state.compliance, log_ns)
        self._force(FIXTURE, state.wrench, log_ns)
        if self._is_due(FIXTURE, log_ns):
            along = GUIDANCE_M * state.factor * state.preferred_direction
            self._rows.add(
                entity(BASE, "guidance"),
                rr.Arrows3D,
                log_ns,
                vectors=listed(along),
                origins=self._tool_position,
            )

    def belief(self, model: str, belief: Belief, log_ns: int) -> None:
        """Show a recognizer's belief; that of the active one colors the ways."""
        colors = {name: state_color(k) for k, name in enumerate(belief.states)}
        self._colors |= colors
        probabilities = dict(zip(belief.states, listed(belief.probabilities), strict=True))
        for name, probability in probabilities.items():
            self._scalar((BELIEFS, model, name), probability, log_ns, colors[name])
        self._scalar((BELIEFS, model, "unknown"), belief.unknown, log_ns, UNKNOWN_COLOR)
        likely = "" if belief.unknown > belief.confidence else belief.likely_state
        self._state(f"believed by {model}", likely, log_ns)
        if self._active in ("", model):
            self._color = colors.get(likely, UNKNOWN_COLOR)

    def finish(self) -> None:
        """Send labels, ways, and what of the rest is not sent yet."""
        import rerun as rr

        for label in labels_of(self._content):
            self._state("labeled", label.state, label.begin_ns)
            self._state("labeled", "", label.end_ns)
        self._rows.finish()
        self._stream.log(entity(OPERATOR, "path"), self._hand.lines(), static=True)
        self._stream.log(entity(BASE, "path"), self._tool.lines(), static=True)
        states = rr.StateConfiguration(
            values=list(self._colors), colors=color_numbers(list(self._colors.values()))
        )
        for lane in self._last:
            self._stream.log(entity(STATES, lane), states, static=True)

    def _drawn(self, robot: str) -> DrawnRobot | None:
        """The robot of that name; None, which is noted, where the recording cannot show it."""
        if robot not in self._robots:
            try:
                urdf = self._content.attachments[f"{robot}.urdf"]
                self._robots[robot] = DrawnRobot(self._stream, robot, urdf)
            except KeyError:
                self._robots[robot] = None
                self.notes.append(f"{robot}: the recording does not say how it looks: tool only")
            except UserError as error:
                self._robots[robot] = None
                self.notes.append(f"{error}: tool only")
        return self._robots[robot]

    def _is_due(self, what: str, log_ns: int) -> bool:
        """Whether what moves is drawn anew: more often than EVERY_NS nobody sees."""
        if log_ns - self._drawn_ns.get(what, -EVERY_NS) < EVERY_NS:
            return False
        self._drawn_ns[what] = log_ns
        return True

    def _axes(self, *parts: str) -> None:
        import rerun as rr

        self._stream.log(entity(*parts), rr.TransformAxes3D(AXES_M), static=True)

    def _scalar(
        self, parts: tuple[str, ...], value: float, log_ns: int, color: str | None = None
    ) -> None:
        import rerun as rr

        name = entity(*parts)
        if name not in self._named:
            self._named.add(name)
            colors = None if color is None else color_numbers([color])
            series = rr.SeriesLines(names=[" ".join(parts[1:])], colors=colors)
            self._stream.log(name, series, static=True)
        self._rows.add(name, rr.Scalars, log_ns, scalars=float(value))

    def _force(self, whose: str, wrench: Any, log_ns: int) -> None:
        for axis, newton in zip("xyz", listed(wrench[:3]), strict=True):
            self._scalar((FORCES, f"{whose} {axis}"), newton, log_ns)

    def _state(self, lane: str, state: str, log_ns: int) -> None:
        """Let a lane of states change; an empty one leaves a gap."""
        import rerun as rr

        if self._last.get(lane) != state:
            self._last[lane] = state
            self._rows.add(entity(STATES, lane), rr.StateChange, log_ns, state=state)
