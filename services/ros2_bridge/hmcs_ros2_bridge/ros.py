"""A node of ROS 2 beside the loop of a process: the one place that touches rclpy."""

from __future__ import annotations

import contextlib
import importlib
import threading
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Literal, NamedTuple

from hmcs.errors import UserError

MISSING = (
    "ROS 2 cannot be imported: {reason}: install its wheels with `uv pip install "
    "'hmcs-ros2-bridge[ros]'` (CPython 3.11), or use the Python of an installed ROS 2 after "
    "`source /opt/ros/DISTRIBUTION/setup.bash`"
)
Profile = Literal["sensor", "reliable", "latched"]
"""`sensor`: best effort, as ROS' sensor data, the newest alone. `reliable`: every message.
`latched`: reliable, and a late subscriber gets the last one."""


_LATCHED_HEARD = 100
"""What several publishers have latched comes at once; none of it may be lost."""


class Topic(NamedTuple):
    """A topic and the type of its messages."""

    name: str
    """As in ROS; remapped by `ros_args`."""
    kind: str
    """Of its messages, e.g. `geometry_msgs/TwistStamped`."""
    profile: Profile


class Publisher(NamedTuple):
    """Publishes on a topic, of fields."""

    put: Callable[[dict[str, Any]], None]
    """Publish a message with these fields."""
    others: Callable[[], int]
    """How many publishers besides this one the topic has."""


class Node:
    """A node with a thread of its own, on which its subscriptions are served."""

    def __init__(self, name: str, ros_args: Sequence[str] = ()) -> None:
        """Join the ROS domain of ROS_DOMAIN_ID.

        `ros_args` are what `ros2 run` has after --ros-args, e.g. `-r`, `tool_pose:=/arm/pose`.
        Raises UserError where there is no rclpy, or the arguments are wrong.
        """
        rclpy = module("rclpy")
        self._context = rclpy.Context()
        try:
            rclpy.init(args=["--ros-args", *ros_args], context=self._context)
            self._node = rclpy.create_node(name, context=self._context)
        # rclpy raises its own kinds of errors, of several modules.
        except Exception as error:
            self._context.try_shutdown()
            raise UserError(f"ros_args: {' '.join(ros_args)!r}: {error}") from error
        self._executor = module("rclpy.executors").SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name="ros", daemon=True)

    def start(self) -> None:
        """Serve subscriptions from now on."""
        self._thread.start()

    def now_ns(self) -> int:
        """Return the time by ROS' clock, ns."""
        time_ns: int = self._node.get_clock().now().nanoseconds
        return time_ns

    def publisher(self, topic: Topic) -> Publisher:
        """Return what publishes on a topic."""
        kind = message_type(topic.kind)
        publisher = self._node.create_publisher(kind, topic.name, _qos(topic.profile))
        full_name = publisher.topic_name
        return Publisher(
            lambda fields: publisher.publish(filled(kind, fields)),
            lambda: self._node.count_publishers(full_name) - 1,
        )

    def subscribe(self, topic: Topic, handler: Callable[[Any], None]) -> None:
        """Call `handler` with every message of a topic, on the thread of the node."""
        kind = message_type(topic.kind)
        qos = _qos(topic.profile, _LATCHED_HEARD)
        self._node.create_subscription(kind, topic.name, handler, qos)

    def close(self) -> None:
        """Leave ROS."""
        self._context.try_shutdown()
        if self._thread.ident is not None:
            self._thread.join(timeout=2.0)
        self._executor.shutdown(timeout_sec=1.0)
        self._node.destroy_node()

    def _spin(self) -> None:
        ended = module("rclpy.executors").ExternalShutdownException
        with contextlib.suppress(ended):
            self._executor.spin()


def module(name: str) -> Any:
    """Return a module of ROS 2; raises UserError where it cannot be imported."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise UserError(MISSING.format(reason=error)) from error


@cache
def message_type(kind: str) -> Any:
    """Return the class of a kind of message, e.g. `geometry_msgs/Twist`."""
    package, _, name = kind.partition("/")
    return getattr(module(f"{package}.msg"), name)


def filled(kind: Any, fields: dict[str, Any]) -> Any:
    """Return a message of a class with the given fields; the others stay at their defaults."""
    message = kind()
    _fill(message, fields)
    return message


def _fill(message: Any, fields: dict[str, Any]) -> None:
    kind: Any = type(message)
    for name, value in fields.items():
        if isinstance(value, dict):
            # The message within is there already: another one would take as long again to make.
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, _value(_kinds_of(kind)[name], value))


@cache
def _kinds_of(kind: Any) -> dict[str, str]:
    kinds: dict[str, str] = kind.get_fields_and_field_types()
    return kinds


def _value(kind: str, value: Any) -> Any:
    if kind.startswith("sequence<") and "/" in kind:
        element = message_type(kind.removeprefix("sequence<").removesuffix(">"))
        return [filled(element, each) for each in value]
    return value


def _qos(profile: Profile, latched: int = 1) -> Any:
    qos = module("rclpy.qos")
    if profile == "sensor":
        return qos.QoSProfile(
            depth=1,
            reliability=qos.ReliabilityPolicy.BEST_EFFORT,
            durability=qos.DurabilityPolicy.VOLATILE,
        )
    if profile == "latched":
        return qos.QoSProfile(depth=latched, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL)
    return qos.QoSProfile(depth=10)
