"""The figures: all of the issue's list, drawn, described by numbers, and the same for a seed."""

import json
import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs_laboratory.command import main
from hmcs_laboratory.figures.catalog import FIGURES, find_figures
from hmcs_laboratory.figures.page import page
from hmcs_laboratory.figures.run import FINDINGS, PAGE, Made, make, make_figures, write

NUMBERS = [
    *("2.5", "2.6", "2.7", "2.8", "2.9", "2.10", *(f"2.{number}" for number in range(12, 18))),
    *("3.2", "3.3", "3.4", "3.6", "3.7", "3.8", "3.9", "3.10"),
    *(f"4.{number}" for number in (*range(2, 14), 15, 16, 17)),
    *("B.1", "B.2", "B.3"),
]
RECORDED = {
    *("2.12", "2.13", "2.14", "3.4", "3.6", "3.7", "3.8", "3.9", "3.10"),
    *("4.13", "4.15", "4.16", "4.17", "B.2", "B.3"),
}
TINY = {
    "repeats": 1,
    "performances": 1,
    "trials": 1,
    "unfloored_trials": 1,
    "test": 1,
    "tasks": 1,
    "kinds": ("line",),
    "compliances": 2,
    "demonstrations": 3,
    "law": ("insistence",),
    "robot": "lag",
    "task": ("lines",),
}
CURVES = {
    "noise_curves": {"noise": (0.1, 0.4), "gestemes": 3, "training": 2},
    "gesteme_curves": {"gestemes": (2, 3), "training": 2},
    "training_curves": {"training": (1, 2), "gestemes": 3},
    "symbol_curves": {"symbols": (3, 6), "gestemes": 3, "training": 2},
}


HELD_TO_THEIR_NUMBERS = ("2.12", "2.13", "2.14", "3.8", "3.9", "3.10", "4.11", "4.12", "4.13")
"""Figures whose text claims something that only a simulated operator's data can bear out."""


def values_in(told):
    """Every number in nested dictionaries and lists."""
    if isinstance(told, dict):
        return [value for each in told.values() for value in values_in(each)]
    if isinstance(told, list | tuple):
        return [value for each in told for value in values_in(each)]
    return [float(told)] if isinstance(told, int | float) else []


@cache
def tiny(number):
    """The figure with settings that take a moment."""
    (figure,) = find_figures([number])
    known = type(figure.settings).model_fields
    few = {**TINY, **CURVES.get(figure.draw.__name__, {})}
    changes = {name: value for name, value in few.items() if name in known}
    settings = type(figure.settings).model_validate({**figure.settings.model_dump(), **changes})
    return make(_with(figure, settings), fast=False, seed=1)


def _with(figure, settings):
    return type(figure)(
        figure.number, figure.title, figure.shows, figure.draw, settings, data_of=figure.data_of
    )


def test_the_catalog_holds_the_figures_of_the_thesis_in_its_order_and_then_others():
    assert [figure.number for figure in FIGURES] == NUMBERS
    assert len({figure.name for figure in FIGURES}) == len(NUMBERS)


def test_figures_of_recorded_motion_say_what_stands_in_for_it():
    assert {figure.number for figure in FIGURES if figure.stand_in} == RECORDED


def test_figures_that_share_data_are_made_of_the_same_settings_fast_or_not():
    by_number = {figure.number: figure for figure in FIGURES}
    for figure in FIGURES:
        if not figure.data_of:
            continue
        for fast in (False, True):
            first = by_number[figure.data_of].chosen(fast=fast).model_dump()
            own = figure.chosen(fast=fast).model_dump()
            shared = (set(first) & set(own)) - {"most", "clusters", "repeats"}
            assert {name: first[name] for name in shared} == {name: own[name] for name in shared}


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: figure.number)
def test_a_figure_is_drawn_and_reported_with_numbers(figure):
    made = tiny(figure.number)
    assert made.files.png.startswith(b"\x89PNG")
    assert made.files.png.endswith(b"IEND\xaeB`\x82")
    assert made.files.svg.strip().endswith(b"</svg>")
    assert len(made.files.png) > 10_000
    json.dumps(made.numbers, allow_nan=False)
    assert any(character.isdigit() for character in made.found)
    assert made.differs


@pytest.mark.parametrize("number", HELD_TO_THEIR_NUMBERS)
def test_every_number_a_text_states_is_one_that_was_measured_or_set(number):
    (figure,) = find_figures([number])
    made = tiny(number)
    known = [*values_in(made.numbers), *values_in(figure.settings.model_dump())]
    for word in re.findall(r"(?<!experiment )(?<![\w.])-?\d+(?:\.\d+)?", made.found):
        decimals = len(word.partition(".")[2])
        rounded = {round(scale * value, decimals) for value in known for scale in (1.0, 100.0)}
        assert float(word) in rounded, f"{word} in {made.found!r}"


@pytest.mark.parametrize("fast", [False, True])
def test_fast_settings_are_settings(fast):
    for figure in FIGURES:
        assert type(figure.chosen(fast=fast)) is type(figure.settings)


@pytest.mark.parametrize("seed", [11, 12, 13])
@pytest.mark.parametrize(
    ("number", "nominal", "right"), [("2.6", 5, 1), ("2.7", 10, 1), ("2.8", 10, 0)]
)
def test_the_elbow_is_found_unless_it_lies_beyond_what_is_searched(number, nominal, right, seed):
    (figure,) = find_figures([number])
    settings = figure.settings.model_copy(update={"repeats": 1})
    numbers = figure.draw(settings, figure.generator(seed)).numbers
    assert (numbers["elbow"] == nominal) == right
    assert (numbers["repeats_found"] == [nominal]) == right
    assert numbers["elbow"] <= numbers["searched"]


def test_more_clusters_are_nearer_to_the_vectors():
    (figure,) = find_figures(["2.5"])
    distances = figure.draw(figure.settings, figure.generator(4)).numbers["mean_distance"]
    assert (np.diff(distances) < 0).all()


def test_curves_tell_the_share_recognized_of_every_method_with_its_interval():
    numbers = tiny("4.3").numbers
    for method in ("od", "md", "fft"):
        for floor in ("", "-no-floor"):
            shares = numbers[f"line_{method}-hmm{floor}"]
            assert len(shares) == len(numbers["noise"]) == 2
            assert all(0 <= share <= 1 for share in shares)
            assert len(numbers[f"line_{method}-hmm{floor}_ci95"]) == 2


def test_a_hand_that_leaves_its_task_is_warned_and_not_before():
    (figure,) = find_figures(["B.2"])
    numbers = figure.draw(figure.settings, figure.generator(5)).numbers
    assert numbers["steps_to_unknown"] is not None
    assert numbers["unknown_in_task"] < 0.05 < 0.2 < numbers["unknown_after"]
    assert numbers["steps"] > numbers["leaves_at_step"] + numbers["steps_to_unknown"]


def test_delays_belong_to_the_changes_drawn():
    (figure,) = find_figures(["3.3"])
    numbers = tiny(figure.number).numbers
    assert len(numbers["delays"]) == figure.settings.lines - 1
    assert len(numbers["order"]) == numbers["directions_found"]
    numbers = tiny("4.12").numbers
    assert len(numbers["changes_at"]) == 4
    for who in ("lhmm", "segment_filter"):
        assert len(numbers[f"{who}_switch_delays"]) == 4
        assert 0 < numbers[f"{who}_accuracy"] <= 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("figures") / "new"
    assert (
        main(["figures", "--fast", "--only", "4.11,2.5", "--output", str(made), "--workers", "1"])
        == 0
    )
    return made


def test_a_page_tells_of_each_figure_and_its_pictures_are_there(folder):
    page = (folder / PAGE).read_text(encoding="utf-8")
    reported = json.loads((folder / FINDINGS).read_text(encoding="utf-8"))
    assert list(reported["figures"]) == ["2.5", "4.11"]
    assert reported["seed"] == 1
    for figure in find_figures(["2.5", "4.11"]):
        assert f"Figure {figure.number}: {figure.title}" in page
        for ending in ("png", "svg"):
            assert f'"{figure.name}.{ending}"' in page
            assert (folder / f"{figure.name}.{ending}").stat().st_size > 0
        for name in type(figure.settings).model_fields:
            assert f"<code>{name}</code>" in page
    assert "4.12" not in page
    assert "seed 1" in page.lower()


def test_a_page_shows_texts_as_they_read():
    evil = '"><script>top.ran=1</script>\x1b[2J'
    (figure,) = find_figures(["2.5"])
    named = replace(figure, title=evil, shows=evil, data_of=evil, stand_in=evil)
    made = Made("2.5", {}, {"seed": evil}, {}, evil, evil, 0.0)
    settings = type("Settings", (), {"model_fields": {"seed": SimpleNamespace(description=evil)}})
    text = page([replace(named, settings=settings())], [made], fast=False, seed=1)
    assert "<script" not in text
    assert "\x1b" not in text
    assert text.count("&lt;script&gt;top.ran=1&lt;/script&gt;\\x1b[2J") >= 8


def test_a_figure_is_the_same_whatever_else_is_made_and_by_how_many(folder, tmp_path):
    make_figures(tmp_path, numbers=["4.11", "4.2"], fast=True, seed=1, workers=2)
    name = "figure_4_11"
    for ending in ("png", "svg"):
        again = (tmp_path / f"{name}.{ending}").read_bytes()
        assert again == (folder / f"{name}.{ending}").read_bytes()
    first, second = (
        json.loads((where / FINDINGS).read_text(encoding="utf-8"))["figures"]["4.11"]
        for where in (folder, tmp_path)
    )
    assert first == second


def test_another_seed_draws_something_else():
    (figure,) = find_figures(["4.11"])
    first, again, other = (make(figure, fast=True, seed=seed).numbers for seed in (1, 1, 2))
    assert first == again != other


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "4.1"], "unknown figure '4.1', did you mean"),
        (["--only", "4.11", "--seed", "-1"], "--seed -1: expected 0 or more"),
        (["--only", "4.11", "--workers", "0"], "--workers 0: expected 1 or more"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(arguments, message, capsys, tmp_path):
    assert main(["figures", *arguments, "--output", str(tmp_path / "none")]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.out == ""
    assert not (tmp_path / "none").exists()


def test_a_folder_that_cannot_be_is_a_users_mistake(tmp_path):
    (tmp_path / "file").write_text("here already")
    with pytest.raises(UserError, match="is no folder"):
        make_figures(tmp_path / "file", numbers=["4.11"], fast=True)
    assert (tmp_path / "file").read_text() == "here already"


def test_an_interrupted_write_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    target = tmp_path / "figure.png"
    write(target, b"old")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(target, b"new and longer")
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]
