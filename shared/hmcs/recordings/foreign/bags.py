"""Bags of ROS 1 (`.bag`) and ROS 2 (`.db3`, or a folder with `metadata.yaml`), by `rosbags`."""

from __future__ import annotations

import heapq
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from hmcs.bounded_files import read_bounded
from hmcs.recordings.foreign.bag_chunks import check_bag
from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.foreign.logs import Log, Message, Topic
from hmcs.recordings.foreign.mcap_files import McapLog
from hmcs.recordings.foreign.ros_types import decoded, modern_name
from hmcs.recordings.foreign.said import kind_of
from hmcs.recordings.reading import RecordingError

METADATA = "metadata.yaml"
"""Of the folder of a bag of ROS 2."""
MOST_METADATA_BYTES = 4 * 1024 * 1024
MOST_FILES = 1000
"""Of a bag that was split."""
BAG1_MAGIC, SQLITE_MAGIC = b"#ROSBAG V", b"SQLite format 3\0"


class BagLog(NamedTuple):
    """One file of a bag."""

    where: Path
    ros1: bool

    def topics(self) -> Sequence[Topic]:
        """Return its topics; RecordingError where it is damaged, or not to be read."""
        counts, types = Counter[str](), dict[str, str]()
        with _opened(self.where, self.ros1) as reader:
            for each in reader.connections:
                counts[each.topic] += each.msgcount
                types[each.topic] = modern_name(each.msgtype)
        return [Topic(name, types[name], kind_of(types[name]), counts[name]) for name in types]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages on some topics; RecordingError where one is damaged."""
        with _opened(self.where, self.ros1) as reader:
            wanted = [each for each in reader.connections if each.topic in topics]
            if not wanted:
                return
            for each, at_ns, data in _read(self, reader, wanted):
                where, type_name = f"{self.where}: {each.topic}", modern_name(each.msgtype)
                said = decoded(where, type_name, bytes(data), ros1=self.ros1)
                yield Message(each.topic, at_ns, said)


class SplitLog(NamedTuple):
    """The files of a bag of ROS 2 as one."""

    where: Path
    parts: tuple[Log, ...]

    def topics(self) -> Sequence[Topic]:
        """Return the topics of all parts."""
        found = dict[str, Topic]()
        for part in self.parts:
            for topic in part.topics():
                before = found.get(topic.name)
                size = topic.size + (0 if before is None else before.size)
                found[topic.name] = topic._replace(size=size)
        return list(found.values())

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of all parts by their times."""
        rows = (part.messages(topics) for part in self.parts)
        return heapq.merge(*rows, key=lambda message: message.log_ns)


def bag_at(path: Path) -> Log:
    """Return the log in the folder of a bag of ROS 2, or in a file of a bag.

    Raises RecordingError where its metadata name no files of it, or it is packed as a whole.
    """
    if not path.is_dir():
        with path.open("rb") as stream:
            return BagLog(path, ros1=stream.read(len(BAG1_MAGIC)) == BAG1_MAGIC)
    names, kind = _files_of(path)
    parts: list[Log] = [
        McapLog(path / name) if kind == "mcap" else BagLog(path / name, ros1=False)
        for name in names
    ]
    return SplitLog(path, tuple(parts))


def _files_of(folder: Path) -> tuple[list[str], str]:
    file = folder / METADATA
    try:
        metadata = yaml.safe_load(read_bounded(file, MOST_METADATA_BYTES))
        information = metadata["rosbag2_bagfile_information"]
        names = [Path(str(each)).name for each in information["relative_file_paths"]]
        kind = str(information["storage_identifier"])
        packed = str(information.get("compression_mode") or "none").lower()
    except (yaml.YAMLError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as e:
        raise RecordingError(
            f"{file}: does not describe a bag of ROS 2 ({type(e).__name__}: {str(e)[:80]}): make "
            f"it anew: ros2 bag reindex {folder}"
        ) from e
    if packed != "none":
        raise RecordingError(
            f"{folder}: is packed by {packed}: unpack it first: ros2 bag convert, without "
            "compression_mode"
        )
    if kind not in ("mcap", "sqlite3"):
        raise RecordingError(f"{file}: is kept as {kind[:40]!r}, expected mcap or sqlite3")
    if not 0 < len(names) <= MOST_FILES:
        raise RecordingError(f"{file}: names {len(names)} files, expected 1 to {MOST_FILES}")
    absent = [name for name in names if not (folder / name).is_file()]
    if absent:
        raise RecordingError(f"{file}: names {absent[0][:80]!r}, which is not beside it")
    return names, kind


def _opened(path: Path, ros1: bool) -> Any:
    try:
        from rosbags import rosbag1, rosbag2
    except ImportError as error:
        raise missing("ros", f"{path}: bags are read by rosbags, which is not here") from error
    if ros1:
        check_bag(path)
    else:
        _check_tables(path)
    stack = ExitStack()
    try:
        reader: Any = rosbag1.Reader(path) if ros1 else rosbag2.Reader(path)
        stack.enter_context(reader)
    except MemoryError:
        raise
    # What a damaged file makes the library raise is of many kinds, assertions among them.
    except Exception as error:
        raise _damaged(path, error, ros1) from error
    return _Closing(stack, reader)


class _Closing(NamedTuple):
    stack: ExitStack
    reader: Any

    def __enter__(self) -> Any:
        return self.reader

    def __exit__(self, *error: object) -> None:
        self.stack.close()


def _read(log: BagLog, reader: Any, wanted: Sequence[Any]) -> Iterator[tuple[Any, int, bytes]]:
    messages = reader.messages(connections=wanted)
    while True:
        try:
            found = next(messages, None)
        except MemoryError:
            raise
        except Exception as error:
            raise _damaged(log.where, error, log.ros1) from error
        if found is None:
            return
        yield found


def _damaged(path: Path, error: Exception, ros1: bool) -> RecordingError:
    mend = f"rosbag reindex {path}" if ros1 else "ros2 bag reindex its folder"
    return RecordingError(
        f"{path}: cannot be read ({type(error).__name__}: {str(error)[:200]}): was its recorder "
        f"cut off? Mend it by: {mend}"
    )


def _check_tables(path: Path) -> None:
    """Raise RecordingError where a database is damaged or has more than tables.

    A view or a trigger is a program of the file's author's.
    """
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
            found = database.execute(
                "SELECT type, name, sql FROM sqlite_master WHERE type NOT IN ('table', 'index') "
                "OR sql LIKE 'CREATE VIRTUAL%' LIMIT 1"
            ).fetchone()
            names = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            tables = {name for (name,) in names.fetchmany(MOST_FILES)}
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: is no bag of ROS 2: {error}: was it cut off?") from error
    if found is not None:
        raise RecordingError(f"{path}: has a {found[0]} {str(found[1])[:40]!r}, as no bag has")
    if not {"topics", "messages"} <= tables:
        raise RecordingError(f"{path}: is a database, but no bag of ROS 2: it has no messages")
