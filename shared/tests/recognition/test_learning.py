"""What learning promises: sure recognition, from one demonstration on, and clear errors."""

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of
from hmcs.recognition.content import taken_apart
from hmcs.recognition.gesteme_learning import LearningSettings
from hmcs.recognition.layered import LayeredRecognizer
from hmcs.recognition.learning import learn
from hmcs.recognition.segments import LearningError, segments_of

ORDER = ["along", "round", "up", "along", "round", "up"]
STATE = {"along": 0, "round": 1, "up": 2}


def recognized(model, motion):
    """Most probable state and true state of each step."""
    states = list(model.state_names)
    recognizer = LayeredRecognizer(model)
    steps = steps_of(motion.positions, model.task.dead_zone_m)
    beliefs = [recognizer.step(step) for step in steps]
    middles = [step.position + step.displacement / 2 for step in steps]
    samples = [int(np.linalg.norm(motion.positions - m, axis=1).argmin()) for m in middles]
    true = [states.index(motion.states[k]) for k in samples]
    return np.array([b.belief.states.argmax() for b in beliefs]), np.array(true), beliefs


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_demonstrations_are_enough_to_recognize_the_task(task, performances, count):
    model = learn(task, [performances(["along", "round", "up"], seed) for seed in range(count)])
    right = []
    for seed in (100, 101, 102):
        found, true, _ = recognized(model, performances(ORDER, seed))
        right.append((found == true).mean())
    assert np.mean(right) > 0.93


def test_an_order_never_trained_is_recognized(model, performances):
    found, true, _ = recognized(model, performances(["along", "up", "round", "along"], 7))
    assert (found == true).mean() > 0.85


def test_motion_that_is_no_part_of_the_task_raises_the_alarm_and_the_task_does_not(
    model, performances
):
    _, _, known = recognized(model, performances(ORDER, 55))
    assert np.mean([b.unknown_alarm for b in known]) < 0.1
    angle = np.linspace(0, 6 * np.pi, 600)[:, None]
    spiral = 0.02 * np.hstack([np.cos(angle), 0 * angle, np.sin(2 * angle)]) * (1 + angle / 10)
    recognizer = LayeredRecognizer(model, anywhere=True)
    strange = [recognizer.step(s) for s in steps_of(spiral, model.task.dead_zone_m)]
    assert np.mean([b.unknown_alarm for b in strange[19:]]) > 0.8


def test_learning_twice_gives_the_same_model(task, performances):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(2)]
    one, other = learn(task, demonstrations), learn(task, demonstrations)
    ours, theirs = (taken_apart(each.knowledge) for each in (one, other))
    assert ours.plain == theirs.plain
    for name, array in ours.arrays.items():
        np.testing.assert_array_equal(array, theirs.arrays[name], name)
    assert one.knowledge.scoring == other.knowledge.scoring
    assert one.knowledge.alarm == other.knowledge.alarm


def test_every_phase_leads_somewhere_with_probability_one(model):
    p = model.knowledge.parameters
    total = p.stay + p.advance + p.skip
    possible = total > 0
    np.testing.assert_allclose(total[possible], 1.0)
    np.testing.assert_allclose(p.initial.sum(axis=1), 1.0)
    assert (p.initial[~possible] == 0).all()


def test_recognition_does_not_depend_on_units_of_length(task, performances):
    """A task ten times as large, with ten times the dead zone, is recognized alike."""
    large = task.model_copy(update={"dead_zone_m": 10 * task.dead_zone_m})

    def grown(d):
        return d._replace(positions=10 * d.positions)

    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(3)]
    motion = performances(ORDER, 31)
    small_model = learn(task, demonstrations)
    large_model = learn(large, [grown(d) for d in demonstrations])
    small, _, _ = recognized(small_model, motion)
    big, _, _ = recognized(large_model, grown(motion))
    assert (small[: len(big)] == big[: len(small)]).mean() > 0.99


def test_segments_are_cut_at_labels_and_unlabeled_motion_is_left_out(task, performances):
    motion = performances(["along", "round"], 1)
    blank = motion._replace(states=(None,) * 60 + motion.states[60:])
    segments = segments_of(task, [blank])
    assert [segment.gesteme for segment in segments] == [STATE["along"], STATE["round"]]
    np.testing.assert_array_equal(segments[0].positions[0], motion.positions[60])
    np.testing.assert_array_equal(segments[0].positions[-1], segments[1].positions[0])


def bad(motion, **changes) -> Demonstration:
    return motion._replace(**changes)


def spoiled(values):
    return np.where(np.arange(len(values))[:, None] == 4, np.nan, values)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda m: [], "no demonstrations of task 'corner'"),
        (lambda m: [bad(m, states=(None,) * len(m.states))], "has no labels: add a column 'state'"),
        (
            lambda m: [bad(m, states=("fly",) * len(m.states))],
            "'fly' at .* s is no state.*go, turn, rise",
        ),
        (lambda m: [bad(m, states=("go",) * len(m.states))], "gesteme 'round'.*no demonstration"),
        (lambda m: [bad(m, states=m.states[:-5])], "labels for .* samples: give one each"),
        (lambda m: [bad(m, positions=m.positions[:, :2])], r"positions have shape .*, 3\)"),
        (
            lambda m: [bad(m, positions=spoiled(m.positions))],
            "positions of sample 4 are not finite",
        ),
        (lambda m: [m.cut(0, 1)], "has 1 samples: give two"),
        (lambda m: [m.cut(0, 0)], "has 0 samples: give two"),
        (lambda m: [bad(m, time_s=m.time_s * 0)], "sample 1 is not after the one before"),
        (lambda m: [bad(m, wrenches=np.zeros((3, 6)))], r"wrenches have shape \(3, 6\)"),
        (lambda m: [bad(m, positions=m.positions * 0)], "makes 0 steps, but 2 are needed"),
        (lambda m: [bad(m, positions=m.positions * 1e-3)], "'go'.*makes 0 steps, but 2 are needed"),
    ],
)
def test_demonstrations_that_cannot_be_learned_from_are_told_with_the_remedy(
    task, performances, spoil, message
):
    with pytest.raises(LearningError, match=message):
        learn(task, spoil(performances(["along", "round", "up"], 1)))


def test_refining_by_baum_welch_keeps_recognition(task, performances):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(3)]
    for iterations in (0, 5):
        model = learn(task, demonstrations, LearningSettings(refine_iterations=iterations))
        found, true, _ = recognized(model, performances(ORDER, 77))
        assert (found == true).mean() > 0.93
