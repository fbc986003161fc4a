"""The results of drawn flights: crash detection, counts and metrics of each flight in a batch."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen import __version__
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.experiment.campaign.campaign_file import default, read, scenario
from mambo_sil.experiment.campaign.campaign_flights import (
    MOST_TOGETHER,
    _evaluate,
    columns,
    fly_batch,
)
from mambo_sil.experiment.campaign.parameters import PARAMETERS, draw
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.controllers.pd import PdController, pd_controller
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import HEIGHT_METRICS, measure, saturated_share
from mambo_sil.flight.names import PD_NAMES, PdName
from mambo_sil.flight.scenario import flight_of
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.flight.trajectories import Hover

TILT_RAD = math.acos(0.063 * GRAVITY_M_S2 / NOMINAL.altitude.thrust_max_n)
"""Tilt at which the largest thrust just carries the weight: 59 degrees."""


def flown(**last: Any) -> Trace:
    """Return a take-off and hover of two flights whose middle samples are well, with changes to flight 1."""
    trace = fly(Flight(Hover(), 0.1, 2, start="take-off"), PdController())
    trace.position_m[:] = [0.0, 0.0, -1.1]
    trace.euler_rad[:] = 0.0
    trace.position_m[trace.time_s < 0.0] = 0.0
    for name, values in last.items():
        getattr(trace, name)[505, 1] = values
    return trace


@pytest.mark.parametrize(
    ("last", "crashed"),
    [
        ({}, False),
        ({"euler_rad": [TILT_RAD - 1e-6, 0.0, 3.0]}, False),
        ({"euler_rad": [0.0, TILT_RAD + 1e-6, 0.0]}, True),
        ({"euler_rad": [-TILT_RAD - 1e-6, 0.0, 0.0]}, True),
        ({"euler_rad": [0.8, 0.8, 0.0]}, True),
        ({"euler_rad": [0.7, 0.7, 0.0]}, False),
        ({"euler_rad": [3.0, 0.0, 0.0]}, True),
        ({"euler_rad": [math.nan, 0.0, 0.0]}, True),
        ({"position_m": [9.0, -9.0, 0.0]}, True),
        ({"position_m": [9.0, -9.0, -1e-9]}, False),
        ({"position_m": [0.0, 0.0, 0.1]}, True),
        ({"position_m": [0.0, 0.0, math.nan]}, True),
    ],
    ids=str,
)
def test_a_flight_crashes_on_the_ground_lost_or_tilted_too_far_to_be_carried(
    last: dict[str, Any], crashed: bool
) -> None:
    """One sample is enough; the flight beside it and samples before t = 0, on the ground, do not count."""
    assert detect_crashes(flown(**last)).tolist() == [False, crashed]


def test_a_crash_at_the_start_of_the_clock_counts() -> None:
    """The sample at t = 0 belongs to the flight, the one before it to the take-off."""
    trace = flown()
    assert trace.time_s[500] == 0.0
    trace.position_m[499:501, 1, 2] = [0.0, -1.1]
    assert not detect_crashes(trace).any()
    trace.position_m[500, 1, 2] = 0.0
    assert detect_crashes(trace).tolist() == [False, True]


def expected_row(trace: Trace, pd: str) -> dict[str, object]:
    """Return the row of a flight of a PD alone, without its counts."""
    row: dict[str, object] = {f"{pd}_trace_sha256": trace.digest()}
    limit_rad = Settings().limits.tilt_rad
    row[f"{pd}_saturated_share"] = float(saturated_share(trace.command_rad, float(np.float32(limit_rad)))[0])
    row |= {f"{pd}_{name}": float(values[0]) for name, values in vars(measure(trace)).items()}
    if isinstance(trace, SensedTrace):
        seen = vars(measure(trace.as_seen()))
        row |= {f"{pd}_seen_{name}": float(seen[name][0]) for name in seen if "rad" not in name}
    return row


@pytest.mark.parametrize("pd", PD_NAMES)
@pytest.mark.parametrize("sensors", ["true", "mambo-derotated"])
def test_a_row_holds_the_results_of_the_flight_alone(sensors: str, pd: PdName) -> None:
    """Metrics of the true flight, with sensors also of the estimated error, and digest are those of `fly`."""
    flight = default().flight | {"duration_s": 1.0, "sensors": sensors}
    drawn = [draw(3, number, PARAMETERS) | {"dropped_share": 0.3} for number in range(2)]
    document = Entrant(pd, pd, Settings()).document()
    for row, one in zip(fly_batch(__version__, [document], flight, drawn), drawn, strict=True):
        single = flight_of([scenario(flight, one)], 0.01)
        alone = fly(single, pd_controller(pd, single))
        assert (alone.status == NOT_CALLED).any()
        assert row == {f"{pd}_crashed": 0, f"{pd}_refused_updates": 0} | expected_row(alone, pd)
        titles = {*columns([pd], sensed=sensors != "true", spatial=True), f"{pd}_saturated_share"}
        assert set(row) == titles


def test_more_flights_than_one_simulation_takes_have_the_rows_of_several() -> None:
    """In every bit, NaN included, and in the types."""
    flight = default().flight | {"duration_s": 1.0}
    drawn = [draw(3, number, PARAMETERS) for number in range(MOST_TOGETHER + 1)]
    shared = __version__, [Entrant("pd", "pd", Settings()).document()], flight
    assert repr(fly_batch(*shared, drawn)) == repr(
        fly_batch(*shared, drawn[:1]) + fly_batch(*shared, drawn[1:])
    )


def test_the_table_has_crashes_and_counts_before_metrics_and_digest() -> None:
    """The columns of a controller stand together, each controller after the other."""
    for spatial in (False, True):
        names = [name for name in vars(measure(flown())) if spatial or name not in HEIGHT_METRICS]
        keys = ["crashed", "refused_updates", *names]
        assert columns(["a", "b"], sensed=False, spatial=spatial) == tuple(
            f"{name}_{key}" for name in "ab" for key in [*keys, "trace_sha256"]
        )
        seen = [f"seen_{name}" for name in names if "rad" not in name]
        assert columns(["a"], sensed=True, spatial=spatial) == tuple(
            f"a_{key}" for key in [*keys, *seen, "trace_sha256"]
        )


def test_a_campaign_that_may_draw_a_course_with_a_height_has_its_metrics(tmp_path: Path) -> None:
    """One such curve in a choice is enough."""
    for trajectory, spatial in (('{ choice = ["circle", "helix"] }', True), ('"step"', False)):
        (tmp_path / "one.toml").write_text(f"[flight]\ntrajectory = {trajectory}\n")
        assert read(tmp_path / "one.toml").spatial == spatial


def test_an_update_is_refused_when_the_controller_was_called_and_did_not_accept() -> None:
    """Rejected inputs are counted flight by flight; a dropped update is none, and an accepted one is none."""
    trace = flown()
    trace.status[:, 1] = NOT_CALLED
    trace.status[[1, 2, 9], 1] = [Status.OK, Status.BAD_STATE, Status.BAD_TARGET]
    trace.command_rad[:] = 0.0
    trace.command_rad[:51, 1, 0] = 0.35
    found = _evaluate(trace, 0.35, NOMINAL)
    assert found["refused_updates"] == [0, 2]
    assert found["saturated_share"] == [0.0, 51 / len(trace.time_s)]
