"""Models whose files are not seen here come from the fixture controller that has them loaded."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable

from hmcs.bus.keys import is_name
from hmcs.bus.messages import ModelFile, ModelQuestion
from hmcs.bus.session import Answer
from hmcs.bus.verbs import MODEL_FILE
from hmcs_console.asking import Asking, first_of
from hmcs_console.seeing.models import Models
from hmcs_console.seeing.seen import Seen

AGAIN_AFTER_S = 10.0
"""A model that nobody has sent is asked for again after so long."""
ANSWER_WITHIN_S = 5.0
_MOST_REMEMBERED = 64


class Fetching:
    """Asks for what is drawn and not known; called on the bus' own thread."""

    def __init__(
        self,
        asking: Asking,
        seen: Seen,
        models: Models,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._asking = asking
        self._seen = seen
        self._models = models
        self._clock = clock
        self._asked_s: OrderedDict[tuple[str, str], float] = OrderedDict()

    def ask(self) -> None:
        """Ask once for the model that is wanted, unless that was done a moment ago."""
        wanted = self._models.wanted
        member = first_of("fixture_controller", self._seen.members)
        if wanted is None or member is None or not is_name(wanted[0]):
            return
        now_s = self._clock()
        if now_s - self._asked_s.get(wanted, -AGAIN_AFTER_S) < AGAIN_AFTER_S:
            return
        self._asked_s[wanted] = now_s
        self._asked_s.move_to_end(wanted)
        if len(self._asked_s) > _MOST_REMEMBERED:
            self._asked_s.popitem(last=False)
        name, model_hash = wanted

        def come(answers: list[Answer[ModelFile]]) -> None:
            for answer in answers[:1]:
                if model_hash in ("", answer.body.model_hash):
                    self._models.give(answer.body.content)

        self._asking.ask(
            MODEL_FILE, member, ModelQuestion(model=name), come, timeout_s=ANSWER_WITHIN_S
        )
