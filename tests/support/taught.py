"""What a stack needs that is started by hand: the demo's model, and an operator to be played."""

from __future__ import annotations

from pathlib import Path

from hmcs.task import load_task
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train

MODEL = "human-shapes"
_SHAPES = ("GShape", "NShape", "PShape", "JShape", "Snake")


def taught(folder: Path) -> tuple[Path, Path]:
    """Learn the model in a folder and chain the drawings left out; return the files of both."""
    model, performance = folder / "models" / f"{MODEL}.hmcs", folder / "performance.csv"
    train(MODEL, [f"lasa:{shape}/1-5" for shape in _SHAPES], model)
    perform(load_task(MODEL), [f"lasa:{s}/{k}" for k in (6, 7) for s in _SHAPES], performance)
    return model, performance
