"""What is learned from segments that the models at hand were not learned from."""

import numpy as np
import pytest

from hmcs.recognition.learning import learn
from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS, fit_exit
from hmcs.recognition.segment_filter.filter import FilterSettings, SegmentFilter
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings, fit_gestemes
from hmcs.recognition.segment_filter.gestemes import GestemeBank, Scoring
from hmcs.recognition.segments import LearningError, segments_of
from hmcs.recognition.task_chain import chain_of
from hmcs.recognition.unknown import fit_of, learn_alarm
from hmcs.task import Task

AXES = (0, 1, 2)
QUICK = LearningSettings(refine_iterations=0)


@pytest.fixture(scope="module")
def forked(task):
    """`turn` mostly follows `go`; gestemes are listed in another order than they come in."""
    changed = task.model_dump()
    changed["gestemes"] = changed["gestemes"][::-1]
    after = [{"turn": 0.7, "rise": 0.3}, {"go": 1.0}, {"go": 1.0}]
    for state, follows in zip(changed["states"], after, strict=True):
        state["next"] = follows
    return Task.model_validate(changed)


@pytest.fixture(scope="module")
def shown(performances):
    """No two gestemes equally often, in several orders; one hand goes askew."""
    c, s = np.cos(0.6), np.sin(0.6)
    askew = performances(["along"], 2)
    askew = askew._replace(positions=askew.positions @ [[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return [
        performances(["up", "along", "round"], 0),
        performances(["round", "along"], 1),
        askew,
        performances(["along"], 3),
    ]


@pytest.fixture(scope="module")
def learned(forked, shown):
    return learn(forked, shown, QUICK).knowledge


@pytest.fixture(scope="module")
def rounds(forked, shown):
    """Parameters from all but what one demonstration shows of a gesteme shown more than once."""
    every = segments_of(forked, shown)
    once = [g for g in range(3) if sum(s.gesteme == g for s in every) == 1]
    result = []
    for left in range(len(shown)):
        out = [s for s in every if s.demonstration_index == left]
        kept = [
            [s for s in every if s.gesteme == g and (g in once or s.demonstration_index != left)]
            for g in range(3)
        ]
        result.append((fit_gestemes(kept, AXES, QUICK), out))
    return result


def test_the_exit_is_learned_at_the_true_ends_of_segments_left_out(learned, rounds):
    features, left = [], []
    for parameters, out in rounds:
        for segment in out:
            scoring = Scoring(0.0, 1.0, len(segment.steps), np.inf)
            bank = GestemeBank(parameters, scoring, AXES, [segment.gesteme])
            for k, step in enumerate(segment.steps):
                bank.step(step._replace(index=k))
                features.append(bank.exit_features[0])
            left += [False] * (len(segment.steps) - 1) + [True]
    expected = fit_exit(np.array(features), np.array(left))
    np.testing.assert_allclose(learned.parameters.exit_weights, expected, rtol=1e-6, atol=1e-9)


def test_the_alarm_is_learned_as_the_task_is_performed(forked, learned, rounds):
    fits = []
    for parameters, out in rounds:
        known = parameters._replace(exit_weights=learned.parameters.exit_weights)
        bank = GestemeBank(known, learned.scoring, AXES, range(3))
        task_filter = SegmentFilter(chain_of(forked, anywhere=True), FilterSettings())
        # Go, then what is likely to follow, then what the likely run passes by: by one hand.
        moves = [step for s in sorted(out, key=lambda s: s.state) for step in s.steps]
        here, beliefs = np.zeros(3), []
        for k, step in enumerate(moves):
            beliefs.append(task_filter.step(bank.step(step._replace(index=k, position=here))))
            here = here + step.displacement
        fits.append(
            fit_of(
                np.array([b.log_likelihood for b in beliefs]),
                np.array([b.unknown for b in beliefs]),
            )
        )
    np.testing.assert_allclose(learned.alarm, learn_alarm(fits, QUICK.alarm_window_steps))


def test_a_threshold_below_zero_lowers_no_background(task, performances):
    demonstrations = [performances(["along", "round", "up"], seed) for seed in range(2)]
    # With a background near the best of all steps most known motion fits worse than it.
    high = QUICK._replace(background_quantile=1.0, temperature=0.5, unknown_rise=0.0)
    flat = learn(task, demonstrations, high).knowledge
    raised = learn(task, demonstrations, high._replace(unknown_rise=0.9)).knowledge
    assert flat.alarm.threshold < 0
    assert raised.scoring == flat.scoring
    assert raised.alarm == flat.alarm


def test_where_nothing_is_shown_twice_the_exit_is_the_default_one(task, performances):
    knowledge = learn(task, [performances(["along", "round", "up"], 0)], QUICK).knowledge
    np.testing.assert_array_equal(knowledge.parameters.exit_weights, DEFAULT_WEIGHTS)


def test_the_window_is_so_many_times_the_longest_gesteme_and_at_most_its_limit(task, performances):
    demonstrations = [performances(["along", "round", "up"], 0)]
    steps = [len(segment.steps) for segment in segments_of(task, demonstrations)]
    longest = max(steps)
    assert longest > min(steps)

    def window(**changed):
        said = []
        model = learn(task, demonstrations, QUICK._replace(**changed), progress=said.append)
        cut = any("is not recognized to its end" in text for text in said)
        return model.knowledge.scoring.window_steps, cut

    assert window(window_factor=1.0 + 0.1 / longest) == (longest + 1, False)
    assert window(window_limit_steps=longest + 1) == (longest + 1, False)
    # To leave a gesteme its start is remembered for a step more.
    assert window(window_limit_steps=longest) == (longest, True)


def test_a_window_of_no_step_is_refused(task, performances):
    with pytest.raises(LearningError, match="window_limit_steps is 0, expected 1 to"):
        learn(
            task, [performances(["along", "round", "up"], 0)], QUICK._replace(window_limit_steps=0)
        )
