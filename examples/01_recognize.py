"""Recognize, while a hand moves, which part of a task it is in. All in this process.

python examples/01_recognize.py
"""

from pathlib import Path

from hmcs import load_task, read_demonstration, recognizer, steps_of, train

DATA = Path(__file__).parent / "data"

task = load_task(DATA / "reach-and-lift.yaml")
*shown, performed = (read_demonstration(file) for file in sorted(DATA.glob("hand-*.csv")))
model = train(task, shown)

# A step is made whenever the hand has moved by the task's dead zone, here 8 mm.
recognizes = recognizer(model)
for step in steps_of(performed.positions, task.dead_zone_m):
    belief = recognizes.step(step).belief
    likely = int(belief.states.argmax())
    print(f"step {step.index:2}: {task.states[likely].name:5} {belief.states[likely]:.2f}")
