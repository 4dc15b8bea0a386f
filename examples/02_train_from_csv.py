"""Learn a model from demonstrations in CSV files, keep it in a file, and say how good it is.

    python examples/02_train_from_csv.py [MODEL]

The columns are time_s, x_m, y_m, z_m and state; the last one names the task's state, the label.
"""

import sys
from pathlib import Path

import numpy as np

from hmcs import load_model, load_task, read_demonstration, recognizer, save_model, steps_of, train

DATA = Path(__file__).parent / "data"
file = Path(sys.argv[1] if len(sys.argv) > 1 else "reach-and-lift.hmcs")

task = load_task(DATA / "reach-and-lift.yaml")
*shown, left_out = (read_demonstration(csv) for csv in sorted(DATA.glob("hand-*.csv")))
saved = save_model(train(task, shown, progress=print), file)
print(f"{file}: model {saved.name}, {saved.hash}")

recognizes, right = recognizer(load_model(file)), []
for step in steps_of(left_out.positions, task.dead_zone_m):
    believed = task.states[int(recognizes.step(step).belief.states.argmax())].name
    nearest = int(np.linalg.norm(left_out.positions - step.position, axis=1).argmin())
    right.append(believed == left_out.states[nearest])
print(f"{np.mean(right):.0%} of {len(right)} steps of {left_out.name}, which it has not seen")
