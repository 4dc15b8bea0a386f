"""A recognizer of your own: the state whose gesteme leads, on the whole, where the hand is going.

python examples/04_own_recognizer.py MODEL.hmcs MOTION.csv                   # in this process
python examples/04_own_recognizer.py --model out/up/models/human-shapes.hmcs # beside `hmcs up`
hmcs swap --activate nearest-direction                                # the fixture follows it
"""

import sys
from pathlib import Path

import numpy as np

from hmcs import Service, ServiceSettings, StepFeed, load_model, read_demonstration, run, steps_of
from hmcs.bus.messages import Belief


class NearestDirection:
    def __init__(self, model):
        ends = np.array([model.paths[s.gestemes[0]].points[-1] for s in model.task.states])
        self.directions = ends / np.linalg.norm(ends, axis=1, keepdims=True)

    def probabilities(self, displacement):
        alike = np.exp(4.0 * self.directions @ displacement / np.linalg.norm(displacement))
        return alike / alike.sum()


class Settings(ServiceSettings):
    model: Path


class NearestDirectionService(Service):
    name, Settings = "nearest_direction", Settings

    def start(self):
        self.model = load_model(self.settings.model)
        self.recognizer = NearestDirection(self.model)
        self.belief = self.bus.publisher(Belief, self.bus.keys.belief("nearest-direction"))
        StepFeed(self.bus, self.log, self.on_step).begin()
        # Ready: from now on it may be followed, until this token goes.
        instance = self.settings.instance
        self.bus.announce(self.bus.keys.member("nearest-direction", self.name, instance))

    def on_step(self, fed):
        probabilities = self.recognizer.probabilities(fed.step.displacement)
        likely = self.model.task.states[int(probabilities.argmax())]
        belief = Belief(
            model_hash=self.model.hash,
            clock=fed.clock,
            step=fed.step.index,
            states=self.model.state_names,
            probabilities=probabilities,
            likely_gesteme=likely.gestemes[0],
            segment_start=fed.step.index,
        )
        self.belief.put(belief, fed.origin)


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1].endswith(".hmcs"):
        model = load_model(sys.argv[1])
        mine = NearestDirection(model)
        motion = read_demonstration(sys.argv[2])
        for step in steps_of(motion.positions, model.task.dead_zone_m):
            print(model.state_names[int(mine.probabilities(step.displacement).argmax())])
    else:
        raise SystemExit(run(NearestDirectionService))
