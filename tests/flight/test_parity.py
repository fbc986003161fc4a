"""Whole flights: the compiled C gives the reference's trace, and tracks better than the paper claims."""

from dataclasses import fields

import numpy as np
import pytest

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import CompiledController, build_extension
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.metrics import Metrics, measure
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Bernoulli
from mambo_nmpc.sil.paper.table2 import PRINTED_IMPROVEMENT
from mambo_nmpc.sil.plant.vehicle import Vehicle
from tests.support.cases import SCALARS
from tests.support.tools import toolchain

CASE = Bernoulli(2.0, 0.5)
CONDITIONS = {
    "hover start": Flight(CASE, duration_s=20.0),
    "take-off, turned, in wind": Flight(
        CASE, duration_s=10.0, start="take-off", yaw_rad=0.8, vehicle=Vehicle(wind_m_s2=(0.5, -0.3))
    ),
}


def with_scalar(settings: Settings, scalar: str) -> Settings:
    """Return `settings` with another scalar type."""
    return with_option(settings, "code.scalar", scalar)


def assert_same_bits(a: Trace, b: Trace) -> None:
    """Assert that every array of the traces is equal in every bit."""
    for field in fields(Trace):
        assert getattr(a, field.name).tobytes() == getattr(b, field.name).tobytes(), field.name


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("preset", ["mambo", pytest.param("table1", marks=pytest.mark.long)])
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_flight_with_the_c_is_the_reference_flight(condition: str, preset: str, scalar: str) -> None:
    """All arrays of the trace are equal bit for bit; the closed loop would amplify any difference."""
    settings = with_scalar(presets.load(preset), scalar)
    flight = CONDITIONS[condition]
    extension = build_extension(settings, toolchain("gcc"))
    ours, theirs = ReferenceController(Design(settings)), CompiledController(settings, extension=extension)
    assert_same_bits(fly(flight, ours), fly(flight, theirs))


@pytest.mark.long
@pytest.mark.parametrize("preset", presets.names())
def test_the_hundred_seconds_of_table_2_are_the_reference_flight(preset: str) -> None:
    """Over Table II's 100 s, other compilers and optimization levels give the same bits, too."""
    settings = presets.load(preset)
    flight = Flight(CASE)
    expected = fly(flight, ReferenceController(Design(settings)))
    for compiler in (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2")):
        extension = build_extension(settings, toolchain(*compiler))
        assert_same_bits(expected, fly(flight, CompiledController(settings, extension=extension)))


def indices(metrics: Metrics) -> np.ndarray:
    """Return the four indices of Table II (4,) of the first flight."""
    return np.array([metrics.iae_m_s, metrics.ise_m2_s, metrics.itse_m2_s2, metrics.itae_m_s2])[:, 0]


@pytest.mark.parametrize(
    ("preset", "least"),
    [pytest.param("table1", PRINTED_IMPROVEMENT, marks=pytest.mark.long), ("mambo", (20, 300, 300, 20))],
)
def test_the_presets_improve_on_the_pd(preset: str, least: tuple[float, ...]) -> None:
    """On the Table II case preset table1 improves by more than the paper prints, mambo by at least 20."""
    flight = Flight(CASE)
    pd = indices(measure(fly(flight, PdController())))
    nmpc = indices(measure(fly(flight, CompiledController(presets.load(preset)))))
    assert np.all(pd / nmpc >= least)


def test_mambo_tracks_with_yaw_wind_and_motor_lag() -> None:
    """IAE stays below 5 m s at yaw 0.8 rad, in 0.5 m/s^2 of wind along x or y, with 0.03 s of motor lag."""
    flight = Flight(
        CASE,
        flights=4,
        yaw_rad=np.array([0.8, 0, 0, 0]),
        vehicle=Vehicle(
            motor_lag_s=np.array([0, 0, 0, 0.03]),
            wind_m_s2=(np.array([0, 0.5, 0, 0]), np.array([0, 0, 0.5, 0])),
        ),
    )
    metrics = measure(fly(flight, CompiledController(presets.load("mambo"), 4)))
    assert np.all(metrics.iae_m_s < 5)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_other_scalars_fly_like_float64(scalar: str) -> None:
    """The indices of Table II differ from those of float64 by at most a tenth."""
    flight = Flight(CASE, duration_s=30.0)
    ours, theirs = (
        indices(measure(fly(flight, CompiledController(with_scalar(presets.load("mambo"), kind)))))
        for kind in (scalar, "float64")
    )
    assert np.allclose(ours, theirs, rtol=0.1)
