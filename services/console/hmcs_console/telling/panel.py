"""What stands beside the scene: what is so, why, and what can be asked for."""

from __future__ import annotations

from typing import Any, Protocol

import viser

from hmcs.recognition.registry import kind_names
from hmcs.recognizer_takeover import Question, activate
from hmcs.shown import plain
from hmcs_console.seeing.seen import Picture
from hmcs_console.serving.buttons import (
    BACK,
    CANCEL,
    GO,
    PLAIN,
    STOP,
    TAG,
    TRAIN,
    on_change,
    on_click,
)
from hmcs_console.serving.inbox import pressed_by
from hmcs_console.serving.writing import Choice, add_words, name_button, write
from hmcs_console.teaching import requests
from hmcs_console.teaching.timeline import Editing, Timeline
from hmcs_console.telling import words
from hmcs_console.telling.plots import Plots

_LONGEST_PATH = 4096


class Requests(Protocol):
    """Who carries out what is asked for on the page; called on the page's threads."""

    @property
    def recordings(self) -> Editing:
        """Who shows recordings and sets their labels."""

    def stop(self) -> None:
        """Let every robot stand."""

    def ask(self, question: Question) -> None:
        """Have a process do something."""

    def refuse(self, reason: str) -> None:
        """Say why nothing is asked for."""

    def take_over(self) -> None:
        """Have the fixture follow what was trained last, once it was compared."""

    def activate_now(self) -> None:
        """Have the fixture follow it without comparing it any longer."""

    def back(self) -> None:
        """Have the fixture follow the recognizer that was active before."""

    def label(self, state: str) -> None:
        """Say in which state the hand is from now on; empty ends what was labeled."""

    @property
    def marks_by_pedal(self) -> bool:
        """Whether the pedal begins the next part of the task."""

    def mark_by_pedal(self, on: bool) -> None:
        """Let the pedal begin the next part of the task, or not."""


class Panel:
    """The panel; made and drawn on one thread, asked for things on the page's."""

    def __init__(
        self, gui: viser.GuiApi, carried_out_by: Requests, states: tuple[str, ...], task: str
    ) -> None:
        self._gui = gui
        self._requests = carried_out_by
        self._states = states
        self._folder = ""
        stop = gui.add_button(
            "Stop",
            color="red",
            icon=STOP,
            hint="Every robot stands, no matter who drives it",
        )
        on_click(stop, carried_out_by.stop)
        self._recording = add_words(gui)
        self._answer = add_words(gui)
        tabs = gui.add_tab_group()
        self.operating = tabs.add_tab("Operate")
        with self.operating:
            with gui.add_folder("How to engage, clutch and stop", expand_by_default=False):
                add_words(gui, words.operating())
            self._doing = add_words(gui)
            self._why = add_words(gui, words.why(None))
        self._plots_tab = tabs.add_tab("Plots")
        with self._plots_tab:
            self._plots = Plots(gui, states)
        with tabs.add_tab("Recognizers"):
            self._recognizers = add_words(gui)
            self._choice = Choice(gui, "Recognizer")
            on_click(gui.add_button("Activate", icon=GO), self._activate)
            self._back = gui.add_button(
                "Back", color=PLAIN, icon=BACK, hint="To the one that was active before"
            )
            on_click(self._back, carried_out_by.back)
        self.rules = tabs.add_tab("Task")
        with tabs.add_tab("Teach"):
            self._add_teaching(task)
        with tabs.add_tab("Recordings"):
            self._timeline = Timeline(gui, carried_out_by.recordings, self._use_for_training)
        with tabs.add_tab("Services"):
            self._services = add_words(gui)

    def draw(self, picture: Picture) -> None:
        """Write down a moment."""
        self._take_states(picture.states)
        write(self._recording, words.recording(picture.recording))
        self._recording.visible = bool(picture.recording)
        name_button(self._back, f"Back to {picture.before}" if picture.before else "Back")
        write(self._doing, words.doing(picture.fixture, picture.robot))
        write(self._why, words.why(picture.belief, picture.states))
        nobody = bool(picture.unrun)
        text = words.recognizers(picture.active, picture.agreement, nobody_runs_it=nobody)
        write(self._recognizers, text)
        write(self._services, words.services(picture.health, picture.unrun))
        write(self._training, words.training(picture.training, picture.models))
        write(self._marking, words.marking(picture.marking))
        write(self._answer, picture.answer)
        write(self._takeover, picture.takeover)
        share = picture.training.share if picture.training is not None else 0.0
        self._progress.value = 100.0 * share  # type: ignore[misc]
        self._offer(picture.recognizers)
        self._plots.draw(picture.rows)
        self._timeline.draw(picture.take, picture.states, picture.models)
        self._folder = picture.folder
        self._offered.offer(picture.take.recordings, none_too=True)

    def _add_teaching(self, task: str) -> None:
        gui = self._gui
        with gui.add_folder("Record"):
            name = gui.add_text("Name", "", hint="By date and time where it is empty")
            record = gui.add_button_group("Recording", ("Begin", "End"))
        with gui.add_folder("Label"):
            self._label = Choice(gui, "State", self._states)
            mark = gui.add_button("Mark", icon=TAG, hint="The hand is in it from now on")
            on_click(mark, self._mark)
            pedal = gui.add_checkbox(
                "Pedal begins the next part",
                self._requests.marks_by_pedal,
                hint="Press it where each part begins, and once more where the last one ends",
            )
            self._marking = add_words(gui)
        with gui.add_folder("Train"):
            model = gui.add_text("Model", "taught")
            task_name = gui.add_text("Task", task)
            self._offered = Choice(gui, "Add recording")
            self._offered.on_choice(self._add_recording)
            self._files = gui.add_text("Demonstrations", "", hint="Files, as the trainer sees them")
            kind = Choice(gui, "Recognizer", kind_names())
            find_states = gui.add_checkbox("Find states (no labels needed)", False)
            train = gui.add_button("Train", icon=TRAIN)
            cancel = gui.add_button("Cancel", color=PLAIN, icon=CANCEL)
            on_click(cancel, lambda: self._requests.ask(requests.cancel()))
            self._progress = gui.add_progress_bar(0.0)
            self._training = add_words(gui)
            on_click(
                gui.add_button(
                    "Activate what was trained",
                    icon=GO,
                    hint="After it ran for a while beside the one that is active",
                ),
                self._requests.take_over,
            )
            on_click(
                gui.add_button(
                    "Activate now",
                    color=PLAIN,
                    icon=GO,
                    hint="Without comparing it any longer",
                ),
                self._requests.activate_now,
            )
            self._takeover = add_words(gui)

        async def change_recording(event: viser.GuiEvent[Any]) -> None:
            with pressed_by(event.client_id):
                self._requests.ask(requests.record(event.target.value == "Begin", name.value))

        record.on_click(change_recording)
        on_change(pedal, self._requests.mark_by_pedal)

        def ask_to_train() -> None:
            try:
                question = requests.train(
                    model.value,
                    task_name.value,
                    self._files.value,
                    kind.chosen,
                    find_states=find_states.value,
                )
            except requests.RequestError as error:
                self._requests.refuse(str(error))
            else:
                self._requests.ask(question)

        on_click(train, ask_to_train)

    def _mark(self) -> None:
        self._requests.label(self._label.chosen)

    def _activate(self) -> None:
        if self._choice.chosen:
            self._requests.ask(activate(self._choice.chosen))

    def _add_recording(self, name: str) -> None:
        self._offered.choose("")
        self._use_for_training(f"{self._folder}/{name}" if self._folder else name)

    def _use_for_training(self, path: str) -> None:
        if plain(path, _LONGEST_PATH) != path:
            self._requests.refuse("a recording whose path cannot be shown is not trained from")
            return
        there = [file for file in self._files.value.split(", ") if file]
        if path and path not in there:
            self._files.value = ", ".join([*there, path])  # type: ignore[misc]

    def _take_states(self, states: tuple[str, ...]) -> None:
        """Once a recognizer says what the states are, where no task did."""
        if states == self._states:
            return
        self._states = states
        self._label.offer(states, none_too=True)
        self._plots.remove()
        with self._plots_tab:
            self._plots = Plots(self._gui, states)

    def _offer(self, recognizers: tuple[str, ...]) -> None:
        if recognizers:
            self._choice.offer(recognizers, none_too=False)
