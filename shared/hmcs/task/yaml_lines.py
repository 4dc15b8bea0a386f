"""YAML with line numbers: what a task file says, and on which line it says it.

The origin of a file is unknown, so reading it takes a bounded time and memory:

| bound | reason |
|---|---|
| `MOST_NODES` values, each alias counted with all it stands for | a task of a hundred states has some 3,000; aliases of aliases multiply without a bound |
| `DEEPEST` levels | a task has eight; reading goes down a level for each |
| `LONGEST_NUMBER` characters of a number | the longest double takes 25; reading digits takes time that grows with their square |
| no tags (`!!…`) | a task is made of text, numbers, truth values, lists and mappings alone |
"""  # noqa: E501  rows of a table

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import yaml

Location = tuple[str | int, ...]
"""The way to a value: keys of mappings and indices of lists."""

MOST_NODES = 10_000
DEEPEST = 32
LONGEST_NUMBER = 64

_TEXT = "tag:yaml.org,2002:str"
_MERGE = "tag:yaml.org,2002:merge"
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_READ_FROM_PLAIN_TEXT = (
    *_NUMBERS,
    _MERGE,
    "tag:yaml.org,2002:bool",
    "tag:yaml.org,2002:null",
)


class YamlError(Exception):
    """Text that is not one YAML document; carries the line where it stops making sense."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line
        self.message = message


class Document(NamedTuple):
    """A YAML document and where each of its values stands."""

    data: Any
    lines: dict[Location, int]
    repeated: list[Location]
    """Keys that stand twice in their mapping, at the line of the second."""

    def line_of(self, location: Location) -> int:
        """Return the line of a value, or of the innermost one around it that is there."""
        for end in range(len(location), -1, -1):
            if location[:end] in self.lines:
                return self.lines[location[:end]]
        return 1


def read_yaml(text: str) -> Document:
    """Read one YAML document; keys of mappings are text, whatever they look like.

    Raises YamlError when the text is not YAML, a value holds itself, a key is no plain text, or a
    bound of the module's table is passed. An empty text gives None.
    """
    try:
        loader = _BoundedLoader(text)
        node = loader.get_single_node()
        if node is None:
            return Document(None, {(): 1}, [])
        document = Document(None, {}, [])
        for location, line, again in _walk(node, ()):
            if again:
                document.repeated.append(location)
            document.lines[location] = line
        return document._replace(data=loader.construct_document(node))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        words = [part for part in (error.context, error.problem) if part]
        raise YamlError(line, "not YAML: " + ", ".join(words)) from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise YamlError(line, f"not YAML text: {error.reason}") from error


class _BoundedLoader(yaml.SafeLoader):
    """Composes values within the bounds of the module's table."""

    # Dates, too, are text: a task has none.
    yaml_implicit_resolvers = {  # noqa: RUF012  as in the base class
        first: [(tag, like) for tag, like in resolvers if tag in _READ_FROM_PLAIN_TEXT]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0
        self._nodes = 0
        self._sizes: dict[str, int] = {}
        """How many values stand behind each anchor."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose the next value; raises YamlError where a bound is passed."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        line, anchor = event.start_mark.line + 1, event.anchor
        alias = isinstance(event, yaml.AliasEvent)
        if not alias and event.tag is not None:
            raise YamlError(line, f"not YAML of a task: the tag {event.tag!r}: leave it out")
        if self._depth == DEEPEST:
            raise YamlError(line, f"more than {DEEPEST} levels, one within the other")
        before, self._depth = self._nodes, self._depth + 1
        self._count(1, line)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if alias and anchor not in self._sizes:
            raise YamlError(line, "a value that holds itself (an alias of its own)")
        if alias:
            self._count(self._sizes[anchor] - 1, line)
        elif anchor is not None:
            self._sizes[anchor] = self._nodes - before
        if isinstance(node, yaml.ScalarNode):
            _check_characters(node.value, line)
            if node.tag in _NUMBERS:
                self._check_number(node, line)
        return node

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        """Compose a mapping; raises YamlError for a key that is a list or a mapping."""
        node = super().compose_mapping_node(anchor)
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise YamlError(
                    key.start_mark.line + 1, "a key that is a list or a mapping, expected a name"
                )
            if key.tag != _MERGE:
                key.tag = _TEXT
        return node

    def _count(self, nodes: int, line: int) -> None:
        self._nodes += nodes
        if self._nodes > MOST_NODES:
            raise YamlError(
                line, f"more than {MOST_NODES:,} values, counting what each alias stands for"
            )

    def _check_number(self, node: yaml.ScalarNode, line: int) -> None:
        if len(node.value) > LONGEST_NUMBER:
            raise YamlError(
                line,
                f"a number of {len(node.value):,} characters, at most {LONGEST_NUMBER} are read",
            )
        try:
            # Not `construct_object`, which would remember it: a key becomes text later.
            self.yaml_constructors[node.tag](self, node)
        except ValueError as error:
            raise YamlError(line, f"not YAML: {node.value!r} is no number: {error}") from error


def _check_characters(text: str, line: int) -> None:
    """Refuse half a surrogate pair, which an escape can write but no file can hold."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise YamlError(line, f"not YAML text: {error.reason}") from error


def _walk(node: yaml.Node, location: Location) -> Iterator[tuple[Location, int, bool]]:
    if not location:
        yield location, node.start_mark.line + 1, False
    if isinstance(node, yaml.SequenceNode):
        for index, child in enumerate(node.value):
            yield (*location, index), child.start_mark.line + 1, False
            yield from _walk(child, (*location, index))
    elif isinstance(node, yaml.MappingNode):
        seen = set()
        for key, child in node.value:
            here = (*location, str(key.value))
            yield here, key.start_mark.line + 1, here in seen
            seen.add(here)
            yield from _walk(child, here)
