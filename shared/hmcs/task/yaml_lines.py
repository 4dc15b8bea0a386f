"""YAML with line numbers: what a task file says, and on which line it says it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import yaml

Location = tuple[str | int, ...]
"""The way to a value: keys of mappings and indices of lists."""


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
    """Read one YAML document.

    Raises YamlError when the text is not YAML, or a value holds itself. An empty text gives None.
    """
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return Document(None, {(): 1}, [])
        document = Document(None, {}, [])
        for location, line, again in _walk(node, (), ()):
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
    except (ValueError, RecursionError) as error:
        raise YamlError(1, f"not YAML that can be read: {error}") from error


def _walk(
    node: yaml.Node, location: Location, inside: tuple[int, ...]
) -> Iterator[tuple[Location, int, bool]]:
    if id(node) in inside:
        raise YamlError(node.start_mark.line + 1, "a value that holds itself (an alias of its own)")
    inside = (*inside, id(node))
    if not location:
        yield location, node.start_mark.line + 1, False
    if isinstance(node, yaml.SequenceNode):
        for index, child in enumerate(node.value):
            yield (*location, index), child.start_mark.line + 1, False
            yield from _walk(child, (*location, index), inside)
    elif isinstance(node, yaml.MappingNode):
        seen = set()
        for key, child in node.value:
            here = (*location, str(key.value))
            yield here, key.start_mark.line + 1, here in seen
            seen.add(here)
            yield from _walk(child, here, inside)
