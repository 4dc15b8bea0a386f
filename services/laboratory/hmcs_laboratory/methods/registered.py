"""The lists: which methods studies compare. Adding one is one line here."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator

from hmcs_laboratory.methods.hmm_library import fit_gaussian, fit_symbols, prepare
from hmcs_laboratory.methods.libraries import installed
from hmcs_laboratory.methods.online import OnlineMethod
from hmcs_laboratory.methods.online_peers import (
    learn_concatenated_hmm,
    learn_long_window_trees,
    learn_start_trees,
)
from hmcs_laboratory.methods.recognizers import recognizer
from hmcs_laboratory.methods.series import fit_dtw, fit_rocket, prepare_dtw, prepare_rocket
from hmcs_laboratory.methods.single import fit_single, fit_single_of_share
from hmcs_laboratory.methods.symbol_hmms import SYMBOL_METHODS
from hmcs_laboratory.methods.vectors import fit_lda, fit_svm, fit_trees
from hmcs_laboratory.methods.whole import WholeMethod
from hmcs_laboratory.study import known_once

WHOLE = (
    WholeMethod("hmcs-gestemes", "hmcs_laboratory.single_gestemes.model", fit_single),
    WholeMethod(
        "hmcs-gestemes-share",
        "the same, given which share of the motion it sees, as DTW, MiniRocket, SVM and LDA are",
        fit_single_of_share,
        whole_only=True,
    ),
    *SYMBOL_METHODS,
    WholeMethod(
        "hmmlearn-gaussian",
        "hmmlearn GaussianHMM on directions",
        fit_gaussian,
        prepare,
        library="hmmlearn",
    ),
    WholeMethod(
        "hmmlearn-categorical",
        "hmmlearn CategoricalHMM on symbols",
        fit_symbols,
        prepare,
        library="hmmlearn",
    ),
    WholeMethod(
        "dtw-1nn",
        "aeon DTW, nearest neighbor on positions",
        fit_dtw,
        prepare_dtw,
        whole_only=True,
        library="aeon",
    ),
    WholeMethod(
        "minirocket",
        "aeon MiniRocketClassifier on positions",
        fit_rocket,
        prepare_rocket,
        whole_only=True,
        library="aeon",
    ),
    WholeMethod("svm", "scikit-learn SVC on 12 points and log length", fit_svm, whole_only=True),
    WholeMethod("lda", "scikit-learn shrinkage LDA on the same", fit_lda, whole_only=True),
    WholeMethod("extra-trees", "scikit-learn ExtraTreesClassifier on windows", fit_trees),
)
"""Methods that classify a whole gesteme."""

RECOGNIZERS = (
    recognizer("segment-filter", "hmcs.recognition.segment_filter"),
    recognizer(
        "segment-filter",
        "the same, each gesteme aligned in size and turn while it is performed",
        {"alignment_sigma": "0.16"},
        variant="aligned",
    ),
    *(
        recognizer(
            "lhmm",
            f"Aarno 2007, chapter 4: restart {restart}, {evidence} evidence",
            {"restart": restart, "evidence": evidence},
            variant=f"{restart}-{evidence}",
            marked=restart == "given",
        )
        for restart, evidence in (
            ("given", "winner"),
            ("given", "soft"),
            ("never", "winner"),
            ("cusum", "winner"),
            ("network", "winner"),
            ("network", "soft"),
        )
    ),
    recognizer("online-network", "Li & Okamura 2003"),
    recognizer("gesteme-network", "Hundtofte et al. 2002, online"),
    recognizer("fourier", "Yu et al. 2005"),
    recognizer("chapter-3", "Aarno 2007, chapter 3"),
    recognizer("directions", "HMCS, after Aarno 2007, chapter 3"),
    recognizer("task-hmm", "Hannaford & Lee 1990"),
)
"""Our recognizers that follow a task."""

ONLINE_PEERS = (
    OnlineMethod(
        "extra-trees-window",
        "scikit-learn ExtraTreesClassifier on the last 60 steps",
        learn_long_window_trees,
    ),
    OnlineMethod(
        "extra-trees-start",
        "scikit-learn ExtraTreesClassifier on the last 15 steps and the place since the start",
        learn_start_trees,
    ),
    OnlineMethod(
        "concatenated-hmm", "one Gaussian HMM of all states on directions", learn_concatenated_hmm
    ),
)
"""Others that follow a task."""

ONLINE = (*RECOGNIZERS, *ONLINE_PEERS)
"""Methods that follow a task."""


def _known_whole(names: tuple[str, ...]) -> tuple[str, ...]:
    return known_once("method", names, [method.name for method in WHOLE])


def _known_online(names: tuple[str, ...]) -> tuple[str, ...]:
    return known_once("method", names, [method.name for method in ONLINE])


WholeNames = Annotated[tuple[str, ...], AfterValidator(_known_whole)]
"""Names of methods that classify a whole gesteme; none stands for all."""
OnlineNames = Annotated[tuple[str, ...], AfterValidator(_known_online)]
"""Names of methods that follow a task; none stands for all."""


def whole(names: tuple[str, ...]) -> tuple[WholeMethod, ...]:
    """Return the methods of those names; for none all whose libraries are installed."""
    if names:
        return tuple(method for method in WHOLE if method.name in names)
    return tuple(method for method in WHOLE if not method.library or installed(method.library))


def peers_left_out(names: tuple[str, ...]) -> str:
    """Return a line that names what `whole` leaves out of all methods; empty where nothing."""
    absent = [method for method in WHOLE if method not in whole(names)] if not names else []
    if not absent:
        return ""
    methods = ", ".join(f"{method.name} ({method.library})" for method in absent)
    return f"left out, not installed: {methods}; `make peers` installs all"


def online(names: tuple[str, ...]) -> tuple[OnlineMethod, ...]:
    """Return the methods of those names, or all for none."""
    return tuple(method for method in ONLINE if not names or method.name in names)
