"""What ROS 2 watches: the messages of the cell in ROS' own kinds, for RViz, Foxglove and nodes.

It hears what the operator's page hears and says nothing on the bus, so that nothing that comes from
ROS moves anything by this process.
"""

from __future__ import annotations

import logging
import time
from functools import partial

import numpy as np

from hmcs.bus.keys import ANY
from hmcs.bus.messages import Belief, FixtureState, Motion, RobotState
from hmcs.bus.messages.message import Message
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, model_file_of
from hmcs.task import load_task
from hmcs_ros2_bridge import scene
from hmcs_ros2_bridge.fields import Fields
from hmcs_ros2_bridge.ros import Node, Publisher, Topic
from hmcs_ros2_bridge.settings import Ros2BridgeSettings
from hmcs_ros2_bridge.watching import Seen, diagnostics, hand_pose, joint_state, json_of, tool_pose

TOPICS = {
    "belief": Topic("~/belief", "std_msgs/String", "reliable"),
    "fixture_state": Topic("~/fixture_state", "std_msgs/String", "reliable"),
    "robot_state": Topic("~/robot_state", "std_msgs/String", "reliable"),
    "joint_states": Topic("~/joint_states", "sensor_msgs/JointState", "reliable"),
    "tool_pose": Topic("~/tool_pose", "geometry_msgs/PoseStamped", "reliable"),
    "hand_pose": Topic("~/hand_pose", "geometry_msgs/PoseStamped", "reliable"),
    "scene": Topic("~/scene", "visualization_msgs/MarkerArray", "latched"),
    "guides": Topic("~/guides", "visualization_msgs/MarkerArray", "reliable"),
    "diagnostics": Topic("/diagnostics", "diagnostic_msgs/DiagnosticArray", "reliable"),
}
"""What it publishes; `~` is the name of its node. Remapped as in ROS."""
_NS_PER_S = 1_000_000_000


class Ros2Bridge(Service):
    """Shows ROS what the cell says."""

    name = "ros2_bridge"
    Settings = Ros2BridgeSettings
    settings: Ros2BridgeSettings

    def __init__(self, settings: Ros2BridgeSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._task = load_task(settings.task)
        files = (model_file_of(place, settings.task) for place in settings.models)
        self._models = [load_model(file) for file in files if file is not None]
        self._node = Node(settings.node, settings.ros_args)
        self._ros: dict[str, Publisher] = {
            name: self._node.publisher(topic) for name, topic in TOPICS.items()
        }
        self._newest: dict[str, tuple[int, Message]] = {}
        self._shown_ns: dict[str, int] = {}
        self._guide = ""
        self._services: set[str] = set()

    def start(self) -> None:
        """Show from now on."""
        bus, settings, keys = self.bus, self.settings, self.bus.keys
        bus.watch(keys.presence(ANY, ANY), self._on_presence)
        bus.subscribe(Motion, keys.motion, self._on_motion)
        bus.subscribe(RobotState, keys.robot_state, self._on_robot_state)
        bus.subscribe(FixtureState, keys.fixture_state, partial(self._told, "fixture_state"))
        bus.subscribe(Belief, keys.belief(), partial(self._told, "belief"))
        self._node.start()
        stamp_ns = self._node.now_ns()
        markers = scene.standing(self._task, stamp_ns, settings.base_frame)
        self._ros["scene"].put({"markers": markers})
        bus.every(settings.scene_every_s, self._show_guide)
        bus.every(settings.diagnostics_every_s, self._show_diagnostics)

    def facts(self) -> dict[str, str]:
        """Return what it shows."""
        return {"task": self._task.name, "models": str(len(self._models))}

    def close(self) -> None:
        """Leave ROS."""
        self._node.close()

    def _on_presence(self, key: str, alive: bool) -> None:
        (self._services.add if alive else self._services.discard)(key)

    def _told(self, name: str, received: Received[Belief] | Received[FixtureState]) -> None:
        self._note(name, received.received_ns, received.body)
        self._ros[name].put(json_of(received.body))

    def _on_motion(self, received: Received[Motion]) -> None:
        self._note("motion", received.received_ns, received.body)
        if self._due("hand_pose"):
            frame = self.settings.operator_frame
            self._ros["hand_pose"].put(hand_pose(received.body, self._node.now_ns(), frame))

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        state = received.body
        self._note("robot_state", received.received_ns, state)
        if self._due("robot_state"):
            stamp_ns, frame = self._node.now_ns(), self.settings.base_frame
            self._ros["tool_pose"].put(tool_pose(state, stamp_ns, frame))
            self._ros["joint_states"].put(joint_state(state, stamp_ns, frame))
            self._ros["robot_state"].put(json_of(state))

    def _note(self, name: str, received_ns: int, body: Message) -> None:
        self._newest[name] = (received_ns, body)

    def _due(self, name: str) -> bool:
        """Return whether a topic with a greatest rate may have another message now."""
        now_ns = time.monotonic_ns()
        if now_ns - self._shown_ns.get(name, 0) < 0.9 * _NS_PER_S / self.settings.poses_rate_hz:
            return False
        self._shown_ns[name] = now_ns
        return True

    def _seen(self) -> Seen:
        oldest_ns = time.monotonic_ns() - self.settings.diagnostics_every_s * _NS_PER_S
        fresh = {name: body for name, (at_ns, body) in self._newest.items() if at_ns >= oldest_ns}
        robot, fixture = fresh.get("robot_state"), fresh.get("fixture_state")
        belief, motion = fresh.get("belief"), fresh.get("motion")
        return Seen(
            robot if isinstance(robot, RobotState) else None,
            fixture if isinstance(fixture, FixtureState) else None,
            belief if isinstance(belief, Belief) else None,
            motion if isinstance(motion, Motion) else None,
        )

    def _show_guide(self) -> None:
        seen, stamp_ns, frame = self._seen(), self._node.now_ns(), self.settings.base_frame
        markers: list[Fields] = []
        fixture, robot = seen.fixture, seen.robot
        leading = "" if fixture is None else fixture.gesteme
        if self._guide not in ("", leading):
            markers += scene.no_guide(self._guide, stamp_ns, frame)
        self._guide = leading
        if fixture is not None and fixture.guide_origin is not None and leading:
            for model in self._models:
                if leading in model.gesteme_names:
                    points = model.paths[leading].points * _scale_of(model)
                    markers += scene.guide(
                        leading, points, fixture.guide_origin, stamp_ns, frame, leads=True
                    )
                    break
        along = np.zeros(3) if fixture is None else fixture.preferred_direction
        if robot is not None:
            markers += scene.direction(robot.tool_position, along, stamp_ns, frame)
        if markers:
            self._ros["guides"].put({"markers": markers})

    def _show_diagnostics(self) -> None:
        names = sorted("/".join(self.bus.keys.member_of(key)) for key in self._services)
        fields = diagnostics(self._seen(), tuple(names), self._node.now_ns())
        self._ros["diagnostics"].put(fields)


def _scale_of(model: Model) -> float:
    return model.task.fixture.operator_scale
