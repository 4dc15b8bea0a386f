"""What learning promises: sure recognition, from one demonstration on, and clear errors."""

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, steps_of
from hmcs.recognition.learning import learn
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.segment_filter.gestemes import GestemeBank, Scoring
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs.recognition.segment_filter.variants import VariantSettings
from hmcs.recognition.segments import LearningError, Segment, segments_of
from hmcs.recognition.serialization import to_arrays
from hmcs.task import Task

ORDER = ["along", "round", "up", "along", "round", "up"]
STATE = {"along": 0, "round": 1, "up": 2}


def recognized(model, motion):
    """Most probable state and true state of each step."""
    states = list(model.state_names)
    recognizer = SegmentFilterRecognizer(model)
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
    recognizer = SegmentFilterRecognizer(model, anywhere=True)
    strange = [recognizer.step(s) for s in steps_of(spiral, model.task.dead_zone_m)]
    assert np.mean([b.unknown_alarm for b in strange[19:]]) > 0.8


def test_learning_twice_gives_the_same_model(task, performances):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(2)]
    one, other = learn(task, demonstrations), learn(task, demonstrations)
    ours, theirs = (to_arrays(each.knowledge) for each in (one, other))
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
def test_demonstrations_that_cannot_be_learned_from_are_reported_with_the_remedy(
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


def fan(angles, steps=30):
    """Straight lines of ten millimeters a step at these angles, as performances of one gesteme."""
    moves = 0.01 * np.stack([np.cos(angles), np.sin(angles), 0 * np.asarray(angles)], axis=1)
    result = []
    for k, move in enumerate(moves):
        made = [Step(t, t * move, move) for t in range(steps)]
        positions = np.arange(steps + 1)[:, None] * move
        result.append(Segment(f"fan-{k}", 0, 0, positions, tuple(made), demonstration_index=k))
    return result


def test_variances_are_shrunk_toward_those_of_all_gestemes_by_how_many_were_shown():
    angle = 0.3
    spread, still = fan([-angle, 0.0, angle]), fan([0.0, 0.0, 0.0])
    settings = LearningSettings(refine_iterations=0, variants=VariantSettings(apart=1e9))
    variances = fit_gestemes([spread, still], (0, 1, 2), settings).variances
    # Of the direction along y: sin² for three lines, nothing for the three that are the same.
    own = np.array([np.sin(angle) ** 2, 0.0])
    prior, floor = own.mean(), settings.direction_floor**2
    expected = (2.0 * own + settings.prior_demonstrations * prior) / (
        2.0 + settings.prior_demonstrations
    )
    np.testing.assert_allclose(variances[:, 0, 4], expected + floor, rtol=1e-6)


def test_each_way_of_performing_a_gesteme_is_begun_as_often_as_it_was_shown():
    rng = np.random.default_rng(0)
    ways = fan([*(0.01 * rng.normal(size=7)), *(np.pi / 2 + 0.01 * rng.normal(size=2))])
    parameters = fit_gestemes([ways], (0, 1, 2), LearningSettings())
    begun = [parameters.initial[0, parameters.variant[0] == v].sum() for v in (0, 1)]
    np.testing.assert_allclose(sorted(begun), [2 / 9, 7 / 9])


def held_out_scores(task, demonstrations):
    """Log density of every step of each demonstration under a model of the others, T = 1."""
    every = segments_of(task, demonstrations)
    scores = []
    for left in range(len(demonstrations)):
        kept = [
            [s for s in every if s.gesteme == g and s.demonstration_index != left] for g in range(3)
        ]
        parameters = fit_gestemes(kept, (0, 1, 2), LearningSettings())
        for segment in (s for s in every if s.demonstration_index == left):
            scoring = Scoring(0.0, 1.0, len(segment.steps) + 1, np.inf)
            bank = GestemeBank(parameters, scoring, (0, 1, 2), [segment.gesteme])
            for k, step in enumerate(segment.steps):
                scores.append(bank.step(step._replace(index=k)).log_ratio[0])
    return np.array(scores)


def test_the_background_lies_one_temperature_below_all_but_a_hundredth_of_known_steps(
    task, performances
):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(3)]
    learned = learn(task, demonstrations, LearningSettings(unknown_rise=0.0)).knowledge
    lowest = np.quantile(held_out_scores(task, demonstrations), 0.01)
    assert learned.scoring.background == pytest.approx(lowest - learned.scoring.temperature)


def test_the_background_is_raised_by_a_share_of_the_alarms_threshold(task, performances):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(3)]
    flat = learn(task, demonstrations, LearningSettings(unknown_rise=0.0)).knowledge
    raised = learn(task, demonstrations, LearningSettings(unknown_rise=0.9)).knowledge
    assert flat.alarm.threshold > 0.1
    rise = flat.scoring.temperature * 0.9 * flat.alarm.threshold
    assert raised.scoring.background == pytest.approx(flat.scoring.background + rise)


def test_files_of_one_name_are_left_out_one_by_one(task, performances):
    different = [performances(["along", "round", "up"], seed) for seed in range(3)]
    same = [each._replace(name="take.csv") for each in different]
    ours, theirs = (learn(task, each).knowledge for each in (different, same))
    assert ours.scoring == theirs.scoring
    assert ours.alarm == theirs.alarm
    np.testing.assert_array_equal(ours.parameters.exit_weights, theirs.parameters.exit_weights)


@pytest.mark.long
def test_a_gesteme_of_hundreds_of_steps_is_recognized_to_its_end(task, performances):
    task = Task.model_validate({**task.model_dump(), "dead_zone_m": 7e-4})
    shown = resampled(performances(["along", "round", "up"], 0), 6)
    model = learn(task, [shown], LearningSettings(refine_iterations=0))
    found, true, _ = recognized(model, resampled(performances(["along", "round", "up"], 9), 6))
    longest = max(np.bincount(true))
    assert longest > 300
    assert model.knowledge.scoring.window_steps > longest
    for state in range(3):
        own = np.flatnonzero(true == state)
        assert (found[own[len(own) // 2 :]] == state).mean() > 0.9


def resampled(demonstration, times):
    """So many samples for one, on straight lines between them."""
    given = np.arange(len(demonstration.time_s))
    wanted = np.linspace(0, given[-1], times * len(given))
    at = [np.interp(wanted, given, column) for column in demonstration.positions.T]
    states = tuple(demonstration.states[int(k)] for k in wanted)
    return Demonstration(demonstration.name, wanted / 100.0, np.stack(at, axis=1), states)


def test_a_window_that_is_set_too_short_is_reported(task, performances):
    said = []
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(2)]
    learn(task, demonstrations, LearningSettings(window_limit_steps=10), progress=said.append)
    assert any("window_limit_steps is 10: it is not recognized to its end" in s for s in said)
    with pytest.raises(LearningError, match="expected 1 to 1999"):
        learn(task, demonstrations, LearningSettings(window_limit_steps=5_000))
