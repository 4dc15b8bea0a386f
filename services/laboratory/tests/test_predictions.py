"""What calibration is judged by: labeled steps only, and gestemes as probable as their states."""

import numpy as np

from hmcs.recognition.scoring import NONE
from hmcs_laboratory.data.tasks import Performance, TaskSet, sequential_task
from hmcs_laboratory.methods.online import Followed
from hmcs_laboratory.studies.calibration import predictions


def test_gestemes_are_as_probable_as_all_their_states_and_unlabeled_steps_are_left_out():
    task = sequential_task("two", ["a", "b", "a"], dead_zone_m=0.01, dimensions=2)
    shown = Performance((), np.array([0, NONE, 2]))
    data = TaskSet(task, (), (shown, shown._replace(states=np.array([1]))), {})
    beliefs = (np.array([[0.5, 0.2, 0.3], [1, 0, 0], [0, 0.5, 0.4]]), np.array([[0.1, 0.9, 0]]))
    said = Followed(beliefs, {})
    states = predictions(said, data)
    np.testing.assert_array_equal(states.true, [0, 2, 1])
    np.testing.assert_array_equal(states.probabilities, np.concatenate(beliefs)[[0, 2, 3]])
    gestemes = predictions(said, data, of_gestemes=True)
    np.testing.assert_array_equal(gestemes.true, [0, 0, 1])
    np.testing.assert_allclose(gestemes.probabilities, [[0.8, 0.2], [0.4, 0.5], [0.1, 0.9]])
