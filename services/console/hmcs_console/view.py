"""The whole page: server, scene, and panel, drawn from pictures."""

from __future__ import annotations

import logging
import time

import numpy as np

from hmcs.bus.messages import TrainingProgress
from hmcs.recognition.model import Model
from hmcs.task import Task
from hmcs_console.drawing.scene import Scene
from hmcs_console.drawing.surroundings import draw_ground, draw_workspace
from hmcs_console.operating.handles import TookOver
from hmcs_console.seeing.models import Models
from hmcs_console.seeing.seen import Picture
from hmcs_console.seeing.shelf import Shelf, active_first
from hmcs_console.serving.page import Page
from hmcs_console.teaching.timeline import TakePath
from hmcs_console.telling.explained import Explained
from hmcs_console.telling.operators import Operators
from hmcs_console.telling.panel import Panel, Requests
from hmcs_console.telling.sounds import Sounds

WORDS_EVERY_S = 0.2
"""How often words and plots are drawn: nobody reads faster."""
_HANDLE_AT_M = (0.5, 0.0, 0.4)


class View:
    """Draws pictures onto the page; `draw` is called on one thread."""

    def __init__(
        self,
        models: Models,
        shelf: Shelf,
        task: Task | None,
        taught: str,
        requests: Requests,
        lease_s: float,
        log: logging.Logger,
    ) -> None:
        start_m = _HANDLE_AT_M if task is None else task.robot.tool_start_m
        self.page = Page(np.array(start_m), lease_s, log)
        server = self.page.server
        states = () if task is None else tuple(state.name for state in task.states)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        x, y, z = start_m
        server.initial_camera.position = (x + 0.6, y - 0.8, z + 0.5)
        server.initial_camera.look_at = (x, y, z)
        draw_ground(server.scene)
        if task is not None:
            draw_workspace(server.scene, task.workspace)
        self._models = models
        self._shelf = shelf
        self._training: TrainingProgress | None = None
        self._scene = Scene(server, log)
        self._path = TakePath(server.scene, np.array(start_m))
        self._panel = Panel(server.gui, requests, states, taught)
        self._explained = Explained(server.gui, self._panel.operating, self._panel.rules, task)
        self._operators = Operators(server, self._panel.operating, self._take_over)
        self._words_s = 0.0
        self.page.serve(self._panel.operating)
        self._sounds = Sounds(server, self._panel.operating)

    def draw(self, picture: Picture) -> None:
        """Draw a moment."""
        server, model = self.page.server, self._followed(picture)
        with server.atomic():
            self._scene.draw(picture, model)
            self._path.draw(picture.take, picture.states, time.monotonic())
        if picture.robot is not None:
            self.page.lead_handles(picture.robot.tool_position, picture.operating_client)
        now_s = time.monotonic()
        if now_s - self._words_s >= WORDS_EVERY_S:
            self._words_s = now_s
            belief = picture.belief
            its_hash = "" if belief is None else belief.model_hash
            known = active_first(self._shelf.look(), picture.active, its_hash)
            picture = picture._replace(models=known)
            with server.atomic():
                self._panel.draw(picture)
                self._operators.draw(picture)
                self._explained.draw(picture, model)
                fixture = picture.fixture
                self._sounds.draw(now_s, None if fixture is None else fixture.off_guide_m)

    def _take_over(self, client: int) -> None:
        self.page.put(TookOver(client))

    def _followed(self, picture: Picture) -> Model | None:
        """The model of the recognizer that is followed; what was trained just now is one, too."""
        if picture.training is not self._training:
            self._training = training = picture.training
            if training is not None and training.stage == "done" and training.path:
                self._models.look_in(training.path)
        belief = picture.belief
        return self._models.find(picture.active, "" if belief is None else belief.model_hash)
