"""Responses of loops and their file: which curves there are, and what is read back."""

import math
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.margins.axis_margins import AxisName, PlaceName
from mambo_sil.experiment.margins.hover_loop import Loops, hover_loops
from mambo_sil.experiment.margins.response_file import Curve, read_responses, responses, write_responses
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Hover
from tests.support.height_settings import height_settings

PERIOD_S = 0.01


@lru_cache
def loops() -> Loops:
    """Return the loops of roll, pitch and height of a Crazyflie."""
    flight = Flight(Hover(), vehicle=Vehicle.from_preset("crazyflie"), update_period_s=PERIOD_S)
    (found,) = hover_loops(height_settings(), flight)
    return found


@pytest.mark.parametrize("motors", [True, False])
def test_curves_are_those_of_each_place(motors: bool) -> None:
    """1 + T of the loop's own answer at each frequency from 0.1 rad/s to half a rate; logarithmic."""
    found = {(curve.axis, curve.place): curve for curve in responses(loops(), PERIOD_S, motors=motors)}
    at_motors = [("roll", "motors"), ("pitch", "motors")] if motors else []
    assert set(found) == {("roll", "command"), ("pitch", "command"), ("height", "command"), *at_motors}
    for (axis, place), curve in found.items():
        loop = loops()[("roll", "pitch", "height").index(axis)]
        channel, rate_s = (0, PERIOD_S) if place == "command" else (1, loop.step_s)
        assert curve.rad_s[-1] == pytest.approx(math.pi / rate_s)
        assert 0.1 < curve.rad_s[0] < 0.105
        assert np.ptp(np.diff(np.log(curve.rad_s))) < 1e-9
        assert 400 < len(curve.rad_s) < 600
        answer = loop.response(curve.rad_s[::20])[:, channel, channel]
        assert curve.sensitivity[::20] == pytest.approx(1.0 + answer, rel=1e-6)


WRITTEN: Final[tuple[tuple[AxisName, PlaceName], ...]] = (
    ("roll", "command"),
    ("roll", "motors"),
    ("height", "command"),
)


def test_a_file_is_read_back(tmp_path: Path) -> None:
    """With six digits; curves of an axis that is not known are left out."""
    rng = np.random.default_rng(1)
    curves = [
        Curve(axis, place, rng.uniform(0.1, 9.0, 7), rng.normal(0, 1, 7) + 1j * rng.normal(0, 1, 7))
        for axis, place in WRITTEN
    ]
    write_responses(curves, tmp_path / "r.csv")
    text = (tmp_path / "r.csv").read_text("utf-8")
    (tmp_path / "r.csv").write_text(text + "yaw,command,1.0,1.0,0.0\n", "utf-8")
    found = read_responses(tmp_path / "r.csv")
    assert [(one.axis, one.place) for one in found] == [(one.axis, one.place) for one in curves]
    for one, curve in zip(found, curves, strict=True):
        assert one.rad_s == pytest.approx(curve.rad_s, rel=1e-5)
        assert one.sensitivity == pytest.approx(curve.sensitivity, rel=1e-5)
    (tmp_path / "r.csv").write_text("axis,broken_at,rad_s\nroll,command,1\n", "utf-8")
    with pytest.raises(ResultsError, match="run margins again"):
        read_responses(tmp_path / "r.csv")
