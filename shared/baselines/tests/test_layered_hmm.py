from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion.steps import Step, steps_of_demonstration
from hmcs.recognition.hmm import inference
from hmcs.recognition.hmm.log_transitions import LogTransitions
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.model_file import load_model, save_model
from hmcs.recognition.registry import recognizer_of, segmentation_of
from hmcs.recognition.segmentation import label_of
from hmcs.recognition.segments import labeled_steps
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.classifying import GestemeHmmClassifier
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings, GestemeScores
from hmcs_baselines.layered_hmm import KIND
from hmcs_baselines.observing import Observed, observations
from hmcs_baselines.restarting import Restart
from hmcs_baselines.task_level import (
    GestemeLevelOutput,
    TaskLevelSettings,
    learn_task_level,
)
from hmcs_baselines.two_levels import LayeredHmmSettings, passed_up, with_marks
from support.lessons import ROUND, lesson_task, performed, steps_performed

GIVEN = LayeredHmmSettings(restart="given")
OBSERVED: tuple[Observed, ...] = ("od", "md", "fft", "direction")
RESTARTS: tuple[Restart, ...] = ("given", "cusum", "network")


@cache
def taught(settings: LayeredHmmSettings) -> Model:
    demonstrations = [performed(seed) for seed in range(4)]
    return learn(lesson_task(), demonstrations, settings, recognizer="lhmm")


def gesteme_likelihoods(model: Model, steps: list[Step]) -> np.ndarray:
    """log P(observations so far | gesteme), shape (T, M), counted from the first step."""
    gestemes = model.knowledge.gestemes
    scores = GestemeScores(gestemes.hmms)
    seen = observations(steps, gestemes.observing, model.axes)
    log_emissions = np.stack([scores.log_emission(each) for each in seen])
    chains = gestemes.hmms.chains
    return np.stack(
        [
            np.logaddexp.reduce(
                inference.forward(chains.initial[m], chains.transition[m], log_emissions[:, m]),
                axis=1,
            )
            for m in range(len(chains.states))
        ],
        axis=1,
    )


def in_segments(steps: list[Step]) -> list[list[Step]]:
    begins = [step.index for step in steps if step.mark]
    return [steps[a:b] for a, b in zip(begins, [*begins[1:], len(steps)], strict=True)]


def test_with_given_restarts_the_task_hmm_filters_the_winner_of_each_segment_alone() -> None:
    model, steps = taught(GIVEN), steps_performed(50)
    winners = np.concatenate(
        [gesteme_likelihoods(model, segment).argmax(axis=1) for segment in in_segments(steps)]
    )
    task = model.knowledge.task
    log_states, log_scales, _ = inference.log_filtered(
        task.initial, LogTransitions(task.transition), np.log(task.gestemes[:, winners]).T
    )
    recognizer = recognizer_of(model)
    begins = np.cumsum([0, *(len(segment) for segment in in_segments(steps))])
    for step, states, log_scale in zip(steps, np.exp(log_states), log_scales, strict=True):
        belief = recognizer.step(step).belief
        np.testing.assert_allclose(belief.states, states, atol=1e-9)
        np.testing.assert_allclose(belief.log_likelihood, log_scale, rtol=1e-9)
        assert belief.segment_start == begins[np.searchsorted(begins, step.index, "right") - 1]


def test_soft_evidence_is_the_posterior_of_the_gestemes() -> None:
    model, steps = taught(GIVEN._replace(evidence="soft")), steps_performed(50)
    likelihoods = np.concatenate(
        [gesteme_likelihoods(model, segment) for segment in in_segments(steps)]
    )
    shares = np.exp(likelihoods - np.logaddexp.reduce(likelihoods, axis=1, keepdims=True))
    task = model.knowledge.task
    expected = inference.log_filtered(
        task.initial, LogTransitions(task.transition), np.log(shares @ task.gestemes.T)
    )
    recognizer = recognizer_of(model)
    for step, states in zip(steps, np.exp(expected.log_states), strict=True):
        np.testing.assert_allclose(recognizer.step(step).belief.states, states, atol=1e-9)


def test_what_the_task_hmm_expects_is_counted_from_the_winners_of_the_demonstrations() -> None:
    model = taught(GIVEN._replace(task=TaskLevelSettings(emission_floor=0.0)))
    counts = np.zeros((len(ROUND), 3))
    for seed in range(4):
        demonstration = performed(seed)
        labeled = labeled_steps(model.task, demonstration)
        switches = np.flatnonzero(np.diff(labeled.states, prepend=-1))
        for begin, end in zip(switches, [*switches[1:], len(labeled.steps)], strict=True):
            segment = list(labeled.steps[begin:end])
            winners = gesteme_likelihoods(model, segment).argmax(axis=1)
            np.add.at(counts[labeled.states[begin]], winners, 1)
    np.testing.assert_allclose(
        model.knowledge.task.gestemes, counts / counts.sum(axis=1, keepdims=True)
    )


def test_states_that_share_a_gesteme_are_distinguished_by_the_order() -> None:
    recognizer = recognizer_of(taught(GIVEN))
    beliefs = np.array([recognizer.step(step).belief.states for step in steps_performed(60)])
    true = labeled_steps(lesson_task(), performed(60)).states
    for state, other in ((1, 3), (3, 1)):
        mean = beliefs[true == state].mean(axis=0)
        assert mean[state] > 10 * mean[other]


def test_an_order_never_trained_stays_possible_and_is_less_so_the_smaller_the_floor() -> None:
    for any_state in (1e-2, 1e-6):
        task = taught(GIVEN._replace(task=TaskLevelSettings(any_state=any_state))).knowledge.task
        np.testing.assert_allclose(task.transition.sum(axis=1), 1.0)
        np.testing.assert_allclose(task.transition.min(), any_state / len(ROUND))


def test_what_the_demonstrations_never_show_is_as_the_task_says() -> None:
    # The demonstrations end with the last state, after which the task begins anew.
    transition = taught(GIVEN).knowledge.task.transition
    lasting = np.mean(
        [(labeled_steps(lesson_task(), performed(s)).states == 3).sum() for s in range(4)]
    )
    np.testing.assert_allclose(transition[3, 0], 1 / lasting, rtol=0.05)


def test_demonstrations_of_one_state_each_are_enough() -> None:
    demonstrations = [performed(seed, (state,)) for seed in range(3) for state in ROUND[:3]]
    model = learn(lesson_task(), demonstrations, GIVEN, recognizer="lhmm")
    recognizer, right = recognizer_of(model), 0
    steps = steps_performed(70)
    states = labeled_steps(model.task, performed(70)).states
    for step, state in zip(steps, states, strict=True):
        right += int(recognizer.step(step).belief.states.argmax()) == state
    assert right / len(steps) > 0.8


def test_offline_the_task_hmm_segments_what_the_gesteme_level_passed_up() -> None:
    model, labeled = taught(LayeredHmmSettings()), labeled_steps(lesson_task(), performed(71))
    found = segmentation_of(model, labeled.steps)
    assert [label_of(model.task, each) for each in found] == list(ROUND)
    states = np.repeat([each.state for each in found], [each.stop - each.start for each in found])
    assert (states == labeled.states).mean() > 0.9


def test_without_a_task_hmm_or_the_pedal_it_was_taught_with_nothing_is_segmented() -> None:
    alone = taught(LayeredHmmSettings(evidence="none"))
    steps = labeled_steps(lesson_task(), performed(72)).steps
    with pytest.raises(UserError, match="no task HMM"):
        segmentation_of(alone, steps)
    with pytest.raises(UserError, match="restarted by the pedal"):
        segmentation_of(taught(GIVEN), steps)
    segmentation_of(taught(GIVEN), steps_performed(72))


@pytest.mark.parametrize("observed", OBSERVED)
@pytest.mark.parametrize("restart", RESTARTS)
def test_all_observations_and_restarts_work_together(observed: Observed, restart: Restart) -> None:
    model = taught(LayeredHmmSettings(observations=observed, restart=restart))
    recognizer, right = recognizer_of(model), 0
    steps = steps_performed(80)
    states = labeled_steps(model.task, performed(80)).states
    for step, state in zip(steps, states, strict=True):
        belief = recognizer.step(step).belief
        assert np.isfinite(belief.log_likelihood)
        assert 0 <= belief.segment_start <= step.index
        right += int(belief.states.argmax()) == state
    assert right / len(steps) > 0.5


@pytest.mark.parametrize("observed", OBSERVED)
def test_a_model_of_any_observations_is_read_back_as_it_was(
    observed: Observed, tmp_path: Path
) -> None:
    model = taught(LayeredHmmSettings(observations=observed))
    file = tmp_path / "model.hmcs"
    saved = save_model(model, file)
    loaded = load_model(file)
    assert loaded.hash == saved.hash
    assert type(loaded.knowledge.gestemes.hmms.emissions) is type(
        model.knowledge.gestemes.hmms.emissions
    )
    pair = recognizer_of(model), recognizer_of(loaded)
    for step in steps_performed(90)[:30]:
        one, other = (recognizer.step(step).belief.states for recognizer in pair)
        np.testing.assert_array_equal(one, other)


def corner_task() -> Task:
    fields = lesson_task().model_dump()
    fields["gestemes"] = fields["gestemes"][:2]
    fields["states"] = [
        {"name": "reach", "gestemes": ["reach"], "next": ["turn"]},
        {"name": "turn", "gestemes": ["turn"], "next": []},
    ]
    return Task.model_validate(fields)


@pytest.mark.parametrize("observed", OBSERVED)
def test_a_gesteme_of_two_straight_steps_is_learned(observed: Observed) -> None:
    demonstration = performed(0, ("reach", "turn"))
    first = demonstration.states.index("turn")
    exact = np.zeros((first, 3))
    exact[:, 0] = np.linspace(0, 0.021, first)
    moved = demonstration.positions[first:] - demonstration.positions[first] + exact[-1]
    short = demonstration._replace(positions=np.concatenate([exact, moved]))
    settings = LayeredHmmSettings(observations=observed, restart="given")
    model = learn(corner_task(), [short], settings, recognizer="lhmm")
    assert model.knowledge.gestemes.hmms.chains.states[0] <= 2
    recognizer = recognizer_of(model)
    for step in steps_of_demonstration(short, 0.01, mark_switches=True):
        assert np.isfinite(recognizer.step(step).belief.states).all()


def test_a_gesteme_never_has_more_states_than_its_shortest_demonstration_has_observations() -> None:
    model = taught(GIVEN._replace(gestemes=GestemeHmmSettings(states=500)))
    task = model.task
    labeled = [labeled_steps(task, performed(seed)) for seed in range(4)]
    lengths = [[(each.gestemes == g).sum() for each in labeled] for g in range(3)]
    states = model.knowledge.gestemes.hmms.chains.states
    assert (states < 500).all()
    assert (states[[0, 2]] <= np.min(lengths, axis=1)[[0, 2]] + 1).all()


def test_no_symbol_is_less_probable_than_the_floor() -> None:
    for floor in (1e-4, 0.01):
        model = taught(GIVEN._replace(gestemes=GestemeHmmSettings(emission_floor=floor)))
        chains, emissions = model.knowledge.gestemes.hmms
        for table, count in zip(emissions.probabilities, chains.states, strict=True):
            assert table[:count].min() == pytest.approx(floor)


def test_without_evidence_there_is_no_task_hmm_and_given_restarts_still_begin_segments() -> None:
    model, steps = taught(GIVEN._replace(evidence="none")), steps_performed(50)
    assert model.knowledge.task is None
    recognizer = recognizer_of(model)
    begins = [segment[0].index for segment in in_segments(steps)]
    for step in steps:
        belief = recognizer.step(step).belief
        assert belief.segment_start == max(begin for begin in begins if begin <= step.index)
        # Two states share a gesteme, and nothing tells them apart.
        np.testing.assert_allclose(belief.states[1], belief.states[3], atol=1e-12)


@pytest.mark.parametrize("evidence", ["none", "winner"])
def test_a_task_hmm_is_known_exactly_where_there_is_evidence_for_it(evidence: str) -> None:
    other = "winner" if evidence == "none" else "none"
    knowledge = taught(GIVEN._replace(evidence=evidence)).knowledge
    with pytest.raises(ValueError, match="evidence"):
        KIND.check(knowledge._replace(evidence=other), lesson_task())


@pytest.mark.parametrize(
    ("part", "field"), [("task", "transition"), ("task", "gestemes"), ("chains", "initial")]
)
def test_knowledge_that_does_not_fit_its_task_is_refused(part: str, field: str) -> None:
    knowledge = taught(GIVEN).knowledge
    hmms = knowledge.gestemes.hmms
    whole = knowledge.task if part == "task" else hmms.chains
    spoiled = whole._replace(**{field: getattr(whole, field)[1:]})
    if part == "task":
        knowledge = knowledge._replace(task=spoiled)
    else:
        knowledge = knowledge._replace(
            gestemes=knowledge.gestemes._replace(hmms=hmms._replace(chains=spoiled))
        )
    with pytest.raises(ValueError, match=field):
        KIND.check(knowledge, lesson_task())


def test_held_out_confusions_are_those_of_gesteme_hmms_that_did_not_see_the_demonstration() -> None:
    task, demonstrations = lesson_task(), [performed(seed) for seed in range(3)]
    # One hand performs everything turned by 50°: the others do not prepare for it.
    turn = np.deg2rad(50.0)
    rotation = np.array(
        [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    odd = demonstrations[2]
    demonstrations[2] = odd._replace(positions=odd.positions @ rotation.T)
    settings = LayeredHmmSettings(observations="md", restart="given")
    outputs = []
    for number, demonstration in enumerate(demonstrations):
        others = [*demonstrations[:number], *demonstrations[number + 1 :]]
        knowledge = learn(task, others, settings, recognizer="lhmm").knowledge
        classifier = GestemeHmmClassifier(
            knowledge.gestemes, axes_of(task), "given", settings.cusum
        )
        labeled = labeled_steps(task, demonstration)
        passed = [passed_up(classifier.step(step), "winner") for step in with_marks(labeled)]
        outputs.append(GestemeLevelOutput(np.array(passed), labeled.states))
    expected = learn_task_level(chain_of(task), outputs, settings.task)
    held_out = settings._replace(confusions="held-out")
    found = learn(task, demonstrations, held_out, recognizer="lhmm").knowledge
    seen = learn(task, demonstrations, settings, recognizer="lhmm").knowledge
    np.testing.assert_allclose(found.task.gestemes, expected.gestemes, atol=1e-12)
    assert not np.allclose(found.task.gestemes, seen.task.gestemes)
    # What recognizes has learned from all demonstrations.
    np.testing.assert_array_equal(
        found.gestemes.hmms.chains.transition, seen.gestemes.hmms.chains.transition
    )


def test_one_demonstration_has_no_held_out_confusions_but_its_own() -> None:
    own, held_out = (
        learn(
            lesson_task(),
            [performed(1)],
            LayeredHmmSettings(confusions=confusions),
            recognizer="lhmm",
        )
        for confusions in ("training", "held-out")
    )
    np.testing.assert_array_equal(own.knowledge.task.gestemes, held_out.knowledge.task.gestemes)
