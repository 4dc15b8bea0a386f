"""Whatever text a message brings, the page shows it as it reads or not at all: message by message.

Each text field of each message of the contract is filled with hostile texts, handed to what keeps
it, and drawn; all that would be sent to browsers is looked at.
"""

from __future__ import annotations

import dataclasses
import logging
import re
from collections.abc import Callable, Iterator, Mapping
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from markdown_it import MarkdownIt

from hmcs.bus.keys import Member
from hmcs.bus.messages import (
    MESSAGES,
    Belief,
    Done,
    Evidence,
    FixtureState,
    Health,
    Label,
    Message,
    Outline,
    Refusal,
    RobotDescription,
    RobotState,
    Segmentation,
    TrainingProgress,
)
from hmcs.errors import UserError
from hmcs.recognition.model_file import load_model
from hmcs.shown import plain
from hmcs_console.operating import stopping
from hmcs_console.order import Order
from hmcs_console.seeing.found import with_found
from hmcs_console.seeing.listening import wrong_with
from hmcs_console.seeing.marking import Marking
from hmcs_console.seeing.models import Models
from hmcs_console.seeing.seen import Seen
from hmcs_console.seeing.shelf import Shelf
from hmcs_console.seeing.takes import Take, opened
from hmcs_console.serving.page import Page
from hmcs_console.teaching import takeover
from hmcs_console.view import View
from support.texts import EXAMPLE_OF, HOSTILE, Path, fields, filled

LOG = logging.getLogger("test")
LONG = "<b>" + "x" * 100_000
JOINER = "\u2060"
# As remark-gfm makes links of running text.
LINKS = (
    re.compile(r"(https?://|www(?=\.))([-.\w]+)([^ \t\r\n]*)", re.IGNORECASE),
    re.compile(r"([-.\w+]+)@([-\w]+(?:\.[-\w]+)+)"),
)
NODE = re.compile(r"(/[A-Za-z0-9._~%-]+)+|/|")


FIELDS = fields()


def test_every_message_has_an_example_and_its_texts_are_found() -> None:
    assert set(EXAMPLE_OF) == set(MESSAGES)
    found = {(kind.__name__, path) for kind, path in FIELDS}
    assert ("Belief", ("states", 0)) in found
    assert ("Health", ("refused", "a key")) in found
    assert ("Description", ("facts", "a value")) in found
    assert ("SettingsReport", ("settings", "a key")) in found
    assert ("LastSteps", ("origins", 0, "boot")) in found
    assert not any(kind.__name__ == "FixtureState" and path == ("reason",) for kind, path in FIELDS)


# --- what keeps it --------------------------------------------------------------------------------

Keep = Callable[[Seen, Any], None]
ACTIVE = "demo"


def keep_belief(seen: Seen, belief: Belief) -> None:
    if not wrong_with(belief):
        for name in (ACTIVE, "other"):
            seen.on_belief(10.0, name, belief)
            seen.write_down(10.0)


def keep_take(seen: Seen, outline: Outline) -> None:
    try:
        seen.take = opened(Take(), outline)  # type: ignore[attr-defined]
    except UserError as error:
        seen.take = Take(said=str(error))  # type: ignore[attr-defined]


def keep_found(seen: Seen, said: Segmentation) -> None:
    take = opened(Take(), EXAMPLE_OF[Outline])  # type: ignore[arg-type]
    try:
        seen.take = with_found(take, said)  # type: ignore[attr-defined]
    except UserError as error:
        seen.take = take._replace(said=str(error))  # type: ignore[attr-defined]


def keep_training(seen: Seen, training: TrainingProgress) -> None:
    seen.training = training
    begun = takeover.begun(training, ACTIVE).takeover
    seen.takeover = takeover.said(begun, 0.0)


def keep_done(seen: Seen, done: Done) -> None:
    seen.answer = stopping.said({Member("robot", "r"): done.detail})
    now = takeover.Takeover("m", ACTIVE, "done", loaded=(done.detail,), detail=done.detail)
    seen.takeover = takeover.said(now, 0.0)


def keep_health(seen: Seen, health: Health) -> None:
    member = Member("robot", "r")
    seen.members.add(member)
    seen.health[member] = health


def set_to(name: str, of: Callable[[Any], Any] = lambda body: body) -> Keep:
    return lambda seen, body: setattr(seen, name, of(body))


KEPT: Mapping[type[Message], Keep] = {
    Belief: keep_belief,
    Evidence: lambda seen, reported: seen.evident(ACTIVE, reported),
    FixtureState: lambda seen, reported: seen.fixture_changed(10.0, reported),
    RobotState: lambda seen, reported: seen.robot_moved(10.0, reported),
    TrainingProgress: keep_training,
    Health: keep_health,
    Done: keep_done,
    Refusal: set_to("answer", lambda body: f"robot refused: {body.reason}"),
    RobotDescription: set_to("looks"),
    Outline: keep_take,
    Segmentation: keep_found,
    Label: set_to("marking", lambda body: Marking(Order("a", {}), True, body.state)),
}
NOT_SHOWN = {
    *("Motion", "Step", "Command", "Handle", "Ask", "Description", "SettingsReport"),
    *("LastStepsQuestion", "LastSteps", "LoadModel", "ActivateRecognizer", "Record", "Train"),
    *(
        "ModelQuestion",
        "ModelFile",
        "OutlineQuestion",
        "SetLabels",
        "ChangeRecording",
        "SegmentQuestion",
        "Pairing",
        "StopRequest",
    ),
}
"""What the page says, or has no use for."""
READ = {
    ("Belief", ("states", 0)),
    ("Belief", ("likely_gesteme",)),
    ("Belief", ("missing_gestemes", 0)),
    ("FixtureState", ("law",)),
    ("FixtureState", ("model",)),
    ("FixtureState", ("gesteme",)),
    ("RobotState", ("robot",)),
    ("RobotState", ("nearest_obstacle",)),
    ("RobotState", ("contacts", 0)),
    ("RobotState", ("limited", 0)),
    ("TrainingProgress", ("model",)),
    ("TrainingProgress", ("detail",)),
    ("TrainingProgress", ("path",)),
    ("Health", ("detail",)),
    ("Done", ("detail",)),
    ("Refusal", ("reason",)),
    ("Outline", ("recordings", 0)),
    ("Outline", ("states", 0)),
    ("Label", ("state",)),
    ("Segmentation", ("model",)),
    ("Segmentation", ("states", 0)),
}
"""Fields whose text a person reads on the page."""


def test_every_message_is_shown_or_known_not_to_be() -> None:
    assert {kind.__name__ for kind in KEPT} | NOT_SHOWN == {kind.__name__ for kind in MESSAGES}
    assert not {kind.__name__ for kind in KEPT} & NOT_SHOWN


# --- what is sent ---------------------------------------------------------------------------------


class Sent:
    """The page, and all that it sends to browsers."""

    def __init__(self, models: Models) -> None:
        class Nobody:
            marks_by_pedal = True
            recordings = property(lambda self: self)

            def __getattr__(self, _: str) -> Callable[..., None]:
                return lambda *_: None

        self.view = View(models, Shelf(()), None, "", Nobody(), 1.0, LOG)
        self.messages: list[Any] = []
        sender = self.view.page.server._websock_server
        inner = sender.queue_message

        def queue(message: Any) -> None:
            self.messages.append(message)
            inner(message)

        sender.queue_message = queue  # type: ignore[method-assign]

    def draw(self, seen: Seen) -> None:
        self.messages.clear()
        picture = seen.picture(10.0, "console-page-1", None)
        self.view._words_s = 0.0
        self.view.draw(picture._replace(take=getattr(seen, "take", Take())))

    @property
    def markdown(self) -> list[str]:
        return [text for name, text in self.texts if name == "_markdown"]

    @property
    def texts(self) -> list[tuple[str, str]]:
        """Each text that was sent, with the name of the field it stands in."""
        return [found for message in self.messages for found in texts_of("", message)]


def texts_of(name: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield name, value
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield "a key", str(key)
            yield from texts_of(str(key), inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from texts_of(name, inner)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from texts_of(field.name, getattr(value, field.name, None))


@pytest.fixture
def sent(model_file: Any) -> Iterator[Sent]:
    made = Sent(Models((load_model(model_file),), (), LOG))
    yield made
    page: Page = made.view.page
    page.close()


PARSER = MarkdownIt("commonmark").enable(["table", "strikethrough"])
HARMLESS = {
    *("paragraph_open", "paragraph_close", "inline", "text", "text_special", "strong_open"),
    *("strong_close", "softbreak", "hardbreak", "bullet_list_open", "bullet_list_close"),
    *("list_item_open", "list_item_close", "table_open", "table_close", "thead_open"),
    *("thead_close", "tbody_open", "tbody_close", "tr_open", "tr_close", "th_open", "th_close"),
    *("td_open", "td_close"),
}

OF_A_DOT = re.compile('<span style="color:#[0-9a-f]{6}">|</span>')
"""The only markup of the page itself: a dot in the color of a state."""


def read(markdown: str) -> str:
    """What a person reads of markdown; fails where it holds more than words, lists and tables."""
    reported = []
    for token in PARSER.parse(markdown):
        for part in [token, *(token.children or ())]:
            if part.type == "html_inline":
                assert OF_A_DOT.fullmatch(part.content), markdown
                continue
            assert part.type in HARMLESS, (part.type, markdown)
            if part.type in ("text", "text_special"):
                reported.append(part.content)
            elif part.type in ("softbreak", "hardbreak", "paragraph_close"):
                reported.append("\n")
    text = "".join(reported)
    for link in LINKS:
        assert not link.search(text), (link.pattern, markdown)
    return text.replace(JOINER, "")


DRAWN = {
    *("svg", "defs", "pattern", "rect", "text", "path", "title", "div", "span"),
}
DRAWN_BY = re.compile(r"[\w .,:;#()%/-]*")
"""What attributes of a drawing say; an address leads to the drawing itself."""


class Drawing(HTMLParser):
    """What a person reads of a drawing; fails where it is more than shapes and words."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag in DRAWN, tag
        for name, value in attrs:
            assert not name.startswith("on"), name
            assert name not in ("href", "src", "xlink:href"), name
            assert DRAWN_BY.fullmatch(value or ""), (name, value)
            assert re.sub(r"url\(#[\w-]+\)", "", value or "").count("url") == 0

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def is_harmless(name: str, text: str) -> bool:
    if name == "name":
        return NODE.fullmatch(text) is not None
    return text.isprintable() and len(text) < 2000 and not set(text) & set("\u200b\u202e\ufeff")


def look_at(sent: Sent, what: str) -> str:
    """What a person reads of all that was sent, which is looked at text by text."""
    reported = []
    for name, text in sent.texts:
        if name == "_markdown":
            reported.append(read(text))
            assert len(text) < 20_000, what
        elif name == "content":
            reported += Drawing(text).words
        else:
            assert is_harmless(name, text), (what, name, text)
            reported.append(text)
    return "\n".join(reported)


def fed(kind: type[Message], path: Path, text: str) -> Seen:
    seen = Seen(())
    seen.robot_moved(10.0, EXAMPLE_OF[RobotState])  # type: ignore[arg-type]
    seen.fixture_changed(10.0, EXAMPLE_OF[FixtureState])  # type: ignore[arg-type]
    keep_belief(seen, EXAMPLE_OF[Belief])  # type: ignore[arg-type]
    if path == ("states", 0):
        # What is likely is what is read.
        seen = Seen(())
    body = filled(EXAMPLE_OF[kind], path, text)
    if path == ("states", 0) and isinstance(body, Belief):
        body = body.model_copy(update={"probabilities": np.array([0.75, 0.125])})
        seen.fixture_changed(10.0, EXAMPLE_OF[FixtureState])  # type: ignore[arg-type]
    if path == ("missing_gestemes", 0):
        seen = Seen(())
        seen.fixture_changed(10.0, EXAMPLE_OF[FixtureState])  # type: ignore[arg-type]
    KEPT[kind](seen, body)
    return seen


SHOWN = [(kind, path) for kind, path in FIELDS if kind in KEPT]


@pytest.mark.parametrize(
    ("kind", "path"),
    SHOWN,
    ids=[f"{kind.__name__}.{'.'.join(map(str, path))}" for kind, path in SHOWN],
)
def test_every_text_of_a_message_is_shown_as_it_reads(
    sent: Sent, kind: type[Message], path: Path
) -> None:
    for text in (*HOSTILE, LONG):
        seen = fed(kind, path, text)
        sent.draw(seen)
        reported = look_at(sent, f"{kind.__name__} {path} {text[:40]!r}")
        if (kind.__name__, path) in READ and text != LONG:
            # Blanks run together where words are laid out; an error quotes what it is about.
            wanted = (" ".join(said.split()) for said in (plain(text), repr(text)[1:-1]))
            assert any(said in " ".join(reported.split()) for said in wanted), (text, reported)
