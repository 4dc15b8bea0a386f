"""Methods: each library is used as it would be by hand, and an online method keeps its promises."""

import sys

import numpy as np
import pytest
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from hmcs.errors import UserError
from hmcs_laboratory.data.gestemes import performed, random_references
from hmcs_laboratory.data.hands import CurveSettings
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states
from hmcs_laboratory.methods import registered
from hmcs_laboratory.methods.features import directions, shape_and_length
from hmcs_laboratory.methods.hmm_library import fit_gaussian, fit_symbols
from hmcs_laboratory.methods.online import followed, learned
from hmcs_laboratory.methods.registered import ONLINE_PEERS, WHOLE
from hmcs_laboratory.methods.whole import measured_on
from hmcs_laboratory.methods.windows import Window
from hmcs_laboratory.single_gestemes.learning import learn_single
from hmcs_laboratory.single_gestemes.model import scores

SETTINGS = CurveSettings()
FEW = 4


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(21)
    curves = random_references(SETTINGS.references, FEW, rng)
    return performed(curves, SETTINGS.operator(0.3), training=4, test=3, rng=rng)


def fitted(name, data):
    (method,) = (method for method in WHOLE if method.name == name)
    method.prepare(data.training)
    return method.fit(data.training, np.random.default_rng(0))


def all_tests(data):
    return [positions for own in data.test for positions in own]


def decisions(method, data):
    return [int(np.argmax(method.classify(each, complete=True))) for each in all_tests(data)]


def vectors(performances):
    return np.array([shape_and_length(p) for own in performances for p in own])


GESTEMES = np.repeat(np.arange(FEW), 4)


@pytest.mark.parametrize(
    ("name", "classifier"),
    [
        ("svm", make_pipeline(StandardScaler(), SVC(C=10.0))),
        ("lda", LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")),
    ],
)
def test_vector_methods_decide_as_scikit_learn_does(data, name, classifier):
    ours = fitted(name, data)
    decided = [
        int(np.argmax(ours.classify(positions, complete=True))) for positions in all_tests(data)
    ]
    by_hand = classifier.fit(vectors(data.training), GESTEMES).predict(vectors(data.test))
    assert decided == by_hand.tolist()


@pytest.mark.parametrize("fit", [fit_symbols, fit_gaussian])
def test_hmmlearn_scores_motions_no_longer_than_its_states(fit):
    ahead = np.outer(np.arange(4.0), [1.0, 0.0])
    able = fit([[ahead, ahead], [-ahead, -ahead]], np.random.default_rng(0))
    assert np.argmax(able.classify(ahead, complete=True)) == 0
    assert np.argmax(able.classify(-ahead, complete=True)) == 1


def test_our_gestemes_score_as_single_gestemes_does(data):
    ours = fitted("hmcs-gestemes", data)
    known = learn_single(data.training)
    for positions in all_tests(data):
        for whole in (True, False):
            np.testing.assert_array_equal(
                ours.classify(positions, complete=whole), scores(known, positions, whole=whole)
            )


def test_hmmlearn_models_score_as_hmmlearn_does(data):
    pytest.importorskip("hmmlearn")
    gaussian = fitted("hmmlearn-gaussian", data)
    symbols = fitted("hmmlearn-categorical", data)
    for positions in all_tests(data):
        observed = directions(positions)
        np.testing.assert_array_equal(
            gaussian.classify(positions, complete=True),
            [model.score(observed) for model in gaussian.models],
        )
        seen = symbols.codebook.predict(observed)[:, None]
        np.testing.assert_array_equal(
            symbols.classify(positions, complete=True),
            [model.score(seen) for model in symbols.models],
        )


def test_the_nearest_neighbor_is_that_of_a_plain_dtw(data):
    pytest.importorskip("aeon")
    ours = fitted("dtw-1nn", data)
    for positions in all_tests(data)[:2]:
        expected = [
            -min(plain_dtw(positions - positions[0], own - own[0]) for own in taught)
            for taught in data.training
        ]
        np.testing.assert_allclose(ours.classify(positions, complete=True), expected)


def plain_dtw(a, b):
    cost = np.full((len(a) + 1, len(b) + 1), np.inf)
    cost[0, 0] = 0
    for i, x in enumerate(a, start=1):
        for j, y in enumerate(b, start=1):
            before = min(cost[i - 1, j], cost[i, j - 1], cost[i - 1, j - 1])
            cost[i, j] = before + ((x - y) ** 2).sum()
    return cost[-1, -1]


def test_minirocket_decides_as_aeons_classifier_does(data):
    rocket = pytest.importorskip("aeon.classification.convolution_based")
    ours = fitted("minirocket", data)
    seed = int(np.random.default_rng(0).integers(2**31))
    resampled = [
        np.stack(
            [
                np.interp(np.linspace(0, 1, ours.samples), np.linspace(0, 1, len(p)), column)
                for column in (p - p[0]).T
            ]
        )
        for p in [p for own in data.training for p in own] + all_tests(data)
    ]
    by_hand = rocket.MiniRocketClassifier(random_state=seed)
    by_hand.fit(np.array(resampled[: len(GESTEMES)]), GESTEMES)
    decided = [
        int(np.argmax(ours.classify(positions, complete=True))) for positions in all_tests(data)
    ]
    assert decided == by_hand.predict(np.array(resampled[len(GESTEMES) :])).tolist()


def test_windows_see_the_past_only_and_stand_still_before_the_start():
    positions = np.cumsum(np.random.default_rng(0).standard_normal((9, 2)), axis=0)
    origin = np.array([1.0, -1.0])
    for window, places in ((Window(3, from_start=True), 1), (Window(3, from_start=False), 3)):
        seen = window.features(positions, origin)
        assert seen.shape == (8, 2 * places + 6)
        np.testing.assert_array_equal(window.features(positions[:5], origin), seen[:4])
        moves = seen[:, 2 * places :]
        np.testing.assert_allclose(moves[5, :2], directions(positions)[5])
        np.testing.assert_allclose(moves[5, 4:], directions(positions)[3])
        np.testing.assert_array_equal(moves[0, 2:], 0)
    np.testing.assert_allclose(seen[5, 4:6], positions[6] - positions[3])
    from_start = Window(3, from_start=True).features(positions, origin)
    np.testing.assert_allclose(from_start[:, :2], positions[1:] - origin)


@pytest.mark.parametrize("name", ["hmcs-gestemes", "svm", "lda", "extra-trees"])
def test_easy_gestemes_are_recognized_and_equal_streams_give_equal_results(name):
    rng = np.random.default_rng(4)
    curves = random_references(CurveSettings(kind="circle").references, 3, rng)
    easy = performed(curves, SETTINGS.operator(0.02), training=3, test=2, rng=rng)
    (method,) = (method for method in WHOLE if method.name == name)
    first, second = (measured_on(method, easy, np.random.default_rng(1))[0] for _ in range(2))
    assert first["accuracy"] == second["accuracy"] == 1.0


def test_a_beginning_is_compared_with_beginnings_by_what_compares_whole_motions():
    rng = np.random.default_rng(4)
    curves = random_references(CurveSettings(kind="circle").references, 3, rng)
    easy = performed(curves, SETTINGS.operator(0.02), training=3, test=2, rng=rng)
    for name in ("hmcs-gestemes", "hmcs-gestemes-share", "svm", "lda"):
        (method,) = (method for method in WHOLE if method.name == name)
        rng = np.random.default_rng(1)
        part, whole = measured_on(method, easy, rng, (0.5, 1.0))
        assert part["accuracy"] == whole["accuracy"] == 1.0
        assert (part["fit_s"] == whole["fit_s"]) == (not method.whole_only)


@pytest.mark.parametrize("method", ONLINE_PEERS, ids=lambda method: method.name)
def test_online_peers_give_probabilities_and_look_at_nothing_to_come(method):
    settings = TaskSettings(demonstrations=3, performances=1)
    task = five_states(settings, 0.1, np.random.default_rng(6))
    able = learned(method, task, np.random.default_rng(1))
    (belief,) = followed(able, task.performances).beliefs
    assert (belief >= 0).all()
    np.testing.assert_allclose(belief.sum(axis=1), 1.0)
    (performance,) = task.performances
    part = performance._replace(steps=performance.steps[:20], states=performance.states[:20])
    (beginning,) = followed(able, [part]).beliefs
    np.testing.assert_array_equal(beginning, belief[:20])
    assert (belief.argmax(axis=1) == performance.states).mean() > 0.8


def test_of_all_methods_those_of_missing_libraries_are_left_out_and_named(monkeypatch):
    monkeypatch.setattr(registered, "installed", lambda library: library != "aeon")
    names = [method.name for method in registered.whole(())]
    assert "dtw-1nn" not in names
    assert {"hmmlearn-gaussian", "lda"} <= set(names)
    assert registered.peers_left_out(()) == (
        "left out, not installed: dtw-1nn (aeon), minirocket (aeon); `make peers` installs all"
    )
    # What is asked for by name is not passed over.
    assert [method.name for method in registered.whole(("dtw-1nn",))] == ["dtw-1nn"]
    assert not registered.peers_left_out(("dtw-1nn",))
    monkeypatch.setattr(registered, "installed", lambda library: True)
    assert not registered.peers_left_out(())


def test_a_missing_library_is_reported_with_what_installs_it(monkeypatch, data):
    monkeypatch.setitem(sys.modules, "hmmlearn", None)
    monkeypatch.delitem(sys.modules, "hmmlearn.hmm", raising=False)
    with pytest.raises(UserError, match="hmmlearn is not installed: `make peers`"):
        fitted("hmmlearn-gaussian", data)
