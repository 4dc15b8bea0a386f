"""Hostile texts, and every place for a text in the messages of the contract."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_args, get_origin

import numpy as np
from pydantic import BaseModel

from hmcs.bus.examples import EXAMPLES
from hmcs.bus.messages import MESSAGES, Message
from hmcs.bus.messages.message import Part

Path = tuple[str | int, ...]
"""Of a text in a message: names of fields, 0 for the first of many, `a key` and `a value`."""

HOSTILE = (
    "<img src=//evil.example onerror=top.ran=1>",
    "<iframe srcdoc='<script>top.ran=1</script>'>",
    "<script>top.ran=1</script>",
    "<svg onload=top.ran=1></svg>",
    "</p></div><style>*{display:none}</style>",
    "&lt;b&gt; &amp;lt; &#60;",
    "![x](https://evil.example/a.png)",
    "![x](/etc/passwd)",
    "[press](javascript:top.ran=1)",
    "[a]: https://evil.example",
    "<https://evil.example>",
    "https://evil.example/x",
    "www.evil.example",
    "me@evil.example",
    "{top.ran=1} ${top.ran=1} {{x}} {0}",
    "**b** *i* _u_ ~~s~~ `c`",
    "```js",
    "# head",
    "- item",
    "1. item",
    "> quote",
    "| a | b |",
    "---",
    "    code",
    "\\\\*a\\\\* \\\\",
    "a\nb\n\n<b>c</b>\r\n# d",
    "\x1b[2J\x1b]0;x\x07\x9b31m",
    "\u202eevil\u2066\u200b\ufeff",
    "a" + "\u0301" * 40,
    "../../x",
    "__proto__",
    "%s %(x)s {x.__class__}",
    " ",
)
"""Each short enough for a name. A script of theirs sets `ran` in the window on top."""

_NO_TEXT = (bytes, int, float, bool, type(None))
EXAMPLE_OF: Mapping[type[Message], Message] = {type(example): example for example in EXAMPLES}


def fields() -> list[tuple[type[Message], Path]]:
    """Return every place for a text, with its message."""
    return [(kind, path) for kind in MESSAGES for path in dict.fromkeys(texts_in(kind))]


def texts_in(kind: Any) -> Iterator[Path]:
    """Return the paths to the texts in a value of a type; of many alike the first."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            yield from ((name, *path) for path in texts_in(field.annotation))
    elif kind is str:
        yield ()
    elif kind is Any:
        yield ("anything",)
    elif get_origin(kind) in (Literal, np.ndarray) or kind in _NO_TEXT:
        return
    elif get_origin(kind) is tuple:
        yield from ((0, *path) for path in texts_in(get_args(kind)[0]))
    elif get_origin(kind) is dict:
        key, value = get_args(kind)
        yield from (("a key", *path) for path in texts_in(key))
        yield from (("a value", *path) for path in texts_in(value))
    else:
        for argument in get_args(kind):
            yield from texts_in(argument)


def filled(value: Any, path: Path, text: str) -> Any:
    """Return a value with a text at a path."""
    if not path:
        return text
    first, *rest = path
    if isinstance(value, Part):
        inner = filled(getattr(value, str(first)), tuple(rest), text)
        return value.model_copy(update={str(first): inner})
    if first == 0:
        return (filled(value[0], tuple(rest), text), *value[1:])
    if first == "a key":
        return {text: next(iter(value.values()), 1)}
    if first == "a value":
        return {"name": filled(None, tuple(rest), text)}
    return {"anything": text}
