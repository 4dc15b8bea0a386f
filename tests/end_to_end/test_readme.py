"""What README and documents show runs as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from hmcs.bus.messages import ActivateRecognizer, Done
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs_local.processes import StackProcess
from support.hand import Scene
from support.stack import Stack, run_python

ROOT = Path(__file__).parents[2]
OWN_RECOGNIZER = ROOT / "docs/how-to/own-recognizer.md"


def program_in(document: Path) -> str:
    """Return the one program of a document."""
    text = document.read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return str(code)


def test_the_program_in_the_readme_tells_the_states_one_after_the_other() -> None:
    done = run_python(["-c", program_in(ROOT / "README.md")], ROOT)
    assert done.returncode == 0, done.stderr
    assert list(dict.fromkeys(done.stdout.split())) == ["reach", "turn", "lift"]


def start_of_how_to(stack: Stack, folder: Path, model_file: Path) -> StackProcess:
    """Start the recognizer of the how-to from the file it says to save it in."""
    script = folder / "my_recognizer.py"
    script.write_text(program_in(OWN_RECOGNIZER), encoding="utf-8")
    return stack.start_program("my_recognizer", "how-to", script, "--model", model_file)


def test_the_recognizer_of_the_how_to_recognizes_and_can_be_activated(
    scene: Scene, model_file: Path, model: Model, steps: list[Step], tmp_path: Path
) -> None:
    stack = scene.stack
    mine = start_of_how_to(stack, tmp_path, model_file)
    fixture = stack.start("fixture_controller", "f", "--models", model_file)
    stack.until_ready(mine, fixture)

    scene.in_step(steps[:250])
    best = SegmentFilterRecognizer(model)
    expected = [int(best.step(step).belief.states.argmax()) for step in steps[:250]]
    found = [int(r.body.probabilities.argmax()) for r in scene.watcher.beliefs]
    assert np.mean(np.array(found) == expected) > 0.6

    key = scene.bus.keys.rpc("fixture_controller", "f", "activate")
    stack.until(lambda: stack.health(fixture).received.get("belief", 0) >= 250)
    (answer,) = scene.bus.ask(key, ActivateRecognizer(model="most-alike"), Done)
    assert answer.body.detail == f"follows most-alike {model.hash}"
    assert mine.stop() == 0
