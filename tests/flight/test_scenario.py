"""Scenarios and records: files, flights in a batch, repetition."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from mambo_sil.drone.plant.airframe import MAMBO as MAMBO_AIRFRAME
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.errors import FlightError, ScenarioError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.own_curve import load_curve
from mambo_sil.flight.scenario import SHARED_KEYS, Record, Scenario, flight_of, read_record, write_record
from mambo_sil.flight.traces import SEEN_COLUMNS
from mambo_sil.flight.trajectories import Bernoulli
from tests.support.command import run
from tests.support.one_norm import ONE_NORM

MAMBO = ONE_NORM
HARD = Scenario(
    seed=2**62 + 1,
    trajectory="gerono",
    size_m=1.0,
    duration_s=2.0,
    start_offset_m=(0.1, 0.2, -0.1),
    start_velocity_m_s=(0.1, -0.1, 0.05),
    start_tilt_rad=(0.02, -0.03),
    yaw_rad=0.4,
    yaw_rate_rad_s=0.1,
    mass_kg=0.068,
    inertia_kg_m2=(6e-5, 7e-5, 1.1e-4),
    thrust_factor_n_s2=4.8e-8,
    torque_factor_n_m_s2=1.2e-10,
    motor_lag_s=0.02,
    drag_1_s=0.05,
    push_m_s2=(0.1, -0.05),
    wind_speed_m_s=4.0,
    wind_direction_rad=1.0,
    battery_sag_1_s=0.001,
    payload_kg=0.003,
    payload_time_s=0.7,
    impulse_n_s=(0.01, 0.005, -0.002),
    impulse_time_s=1.2,
    vertical_gust_m_s2=0.3,
    vertical_gust_time_s=0.6,
    ground_effect_radius_m=0.1,
    command_delay_ticks=3,
    dropped_share=0.1,
    sensors="mambo-derotated",
    noise_scale=0.7,
    accelerometer_bias_m_s2=(0.01, -0.02, 0.03),
    gyro_bias_rad_s=(1e-4, 2e-4, -1e-4),
)
CALM = Scenario(seed=5, duration_s=2.0, sensors="mambo-derotated")


def test_a_record_reads_back_as_it_was_written(tmp_path: Path) -> None:
    """Scenario, settings, controller and digest are equal after writing and reading."""
    record = Record(scenario=HARD, settings=MAMBO, controller="reference", trace_sha256="ab" * 32)
    write_record(record, tmp_path / "flight.json")
    assert read_record(tmp_path / "flight.json") == record


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass_kg": -1.0}, "scenario.mass_kg: Input should be greater than 0"),
        ({"mas_kg": 1.0}, "scenario.mas_kg: Extra inputs are not permitted"),
        ({"payload_kg": -0.07}, "payload_kg must leave a positive mass"),
        ({"seed": -1}, "scenario.seed: Input should be greater than or equal to 0"),
        (
            {"sensors": "radar"},
            "scenario.sensors: Input should be 'true', 'mocap', 'flow-deck', 'autopilot', 'mambo'",
        ),
    ],
)
def test_a_bad_record_names_file_key_and_rule(
    change: dict[str, object], message: str, tmp_path: Path
) -> None:
    """The message names file, key and rule of the wrong entry."""
    path = tmp_path / "bad.json"
    write_record(Record(scenario=HARD, settings=MAMBO), path)
    document = json.loads(path.read_text())
    document["scenario"] |= change
    path.write_text(json.dumps(document))
    with pytest.raises(ScenarioError) as caught:
        read_record(path)
    assert "bad.json: " in str(caught.value)
    assert message in str(caught.value)


def test_file_that_holds_no_record_is_refused(tmp_path: Path) -> None:
    """A file that is missing, not JSON or larger than 1 MB raises `ScenarioError`."""
    (tmp_path / "text").write_text("hello")
    (tmp_path / "large").write_bytes(b" " * 1_000_001)
    record = Record(scenario=HARD, settings=MAMBO)
    write_record(record, tmp_path / "full")
    content = (tmp_path / "full").read_bytes()
    (tmp_path / "full").write_bytes(content + b" " * (1_000_000 - len(content)))
    assert read_record(tmp_path / "full") == record
    for name, message in (
        ("none", "cannot be read"),
        ("text", "Invalid JSON"),
        ("large", "larger than 1 MB"),
    ):
        with pytest.raises(ScenarioError, match=message):
            read_record(tmp_path / name)


LIMITS: dict[str, tuple[float, float]] = {
    "seed": (0, 2**63 - 1),
    "size_m": (-1000.0, 1000.0),
    "rate_rad_s": (-100.0, 100.0),
    "yaw_rad": (-1000.0, 1000.0),
    "duration_s": (5e-324, 3600.0),
    "mass_kg": (5e-324, math.inf),
    "thrust_factor_n_s2": (5e-324, math.inf),
    "torque_factor_n_m_s2": (5e-324, math.inf),
    "motor_lag_s": (0.0, 1.0),
    "drag_1_s": (0.0, math.inf),
    "wind_speed_m_s": (0.0, 50.0),
    "battery_sag_1_s": (0.0, 1.0),
    "command_delay_ticks": (0, 200),
    "dropped_share": (0.0, 1.0),
    "noise_scale": (0.0, 1000.0),
}
"""Least and largest value of each key that has limits; infinity itself is refused."""


@pytest.mark.parametrize("key", LIMITS)
def test_a_key_has_its_limits(key: str) -> None:
    """The limits themselves are accepted, the numbers next to them are not."""
    least, most = LIMITS[key]
    whole = isinstance(least, int)
    below, above = (
        (least - 1, most + 1) if whole else (np.nextafter(least, -np.inf), np.nextafter(most, np.inf))
    )
    for value in (least, min(most, 1e308)):
        assert getattr(Scenario(**{key: value}), key) == value
    for value in (below, above):
        with pytest.raises(ValidationError, match=key):
            Scenario(**{key: value})


@pytest.mark.parametrize(
    ("accepted", "refused", "rule"),
    [
        ({"inertia_kg_m2": (1e-9, 1.0, 1.0)}, {"inertia_kg_m2": (1.0, 0.0, 1.0)}, "three positive numbers"),
        ({"mass_kg": 2.0, "payload_kg": -1.9}, {"mass_kg": 2.0, "payload_kg": -2.0}, "leave a positive mass"),
    ],
)
def test_inertia_and_mass_are_positive(accepted: dict[str, Any], refused: dict[str, Any], rule: str) -> None:
    """A payload may be lost instead of added, but not all the mass."""
    Scenario(**accepted)
    with pytest.raises(ValidationError, match=rule):
        Scenario(**refused)


def test_every_key_reaches_its_field_of_the_simulation() -> None:
    """Column by column, flight by flight."""
    scenarios = (HARD, CALM)
    flight = flight_of(scenarios, 0.02)

    def columns(key: str) -> object:
        return np.array([getattr(one, key) for one in scenarios]).T.tolist()

    offset, sensors = flight.offset, flight.sensors
    assert offset is not None
    assert isinstance(sensors, Sensors)
    for key, found in (
        ("start_offset_m", offset.position_m),
        ("start_velocity_m_s", offset.velocity_m_s),
        ("start_tilt_rad", offset.tilt_rad),
        ("yaw_rad", flight.yaw_rad),
        ("yaw_rate_rad_s", flight.yaw_rate_rad_s),
        ("command_delay_ticks", flight.link.delay_ticks),
        ("dropped_share", flight.link.dropped_share),
        ("mass_kg", flight.vehicle.airframe.mass_kg),
        ("inertia_kg_m2", flight.vehicle.airframe.inertia_kg_m2),
        ("push_m_s2", flight.disturbances.push_m_s2),
        ("impulse_n_s", flight.disturbances.impulse_n_s),
        ("impulse_time_s", flight.disturbances.impulse_time_s),
        ("noise_scale", sensors.noise_scale),
        ("gyro_bias_rad_s", sensors.gyro_bias_rad_s),
    ):
        assert np.array(found).tolist() == columns(key), key
    assert (flight.duration_s, flight.start, flight.update_period_s) == (2.0, "hover", 0.02)
    assert flight.seeds == (HARD.seed, CALM.seed)
    assert sensors.derotated
    for name in ("true", "mambo"):
        other = flight_of([CALM.model_copy(update={"sensors": name})], 0.01).sensors
        assert (other is None) if name == "true" else (isinstance(other, Sensors) and not other.derotated)


NOTHING = (0, (0.0, 0.0), (0.0, 0.0, 0.0))


def test_by_default_nothing_disturbs_a_flight() -> None:
    """All keys are 0 but those of the curve, the drone, and the scale of noise that is off."""
    defaults = Scenario().model_dump(exclude={"vehicle"})
    assert {key: value for key, value in defaults.items() if value not in NOTHING} == {
        "trajectory": "bernoulli",
        "size_m": 2.0,
        "rate_rad_s": 0.5,
        "duration_s": 100.0,
        "start": "hover",
        "mass_kg": MAMBO_AIRFRAME.mass_kg,
        "inertia_kg_m2": MAMBO_AIRFRAME.inertia_kg_m2,
        "thrust_factor_n_s2": MAMBO_AIRFRAME.thrust_factor_n_s2,
        "torque_factor_n_m_s2": MAMBO_AIRFRAME.torque_factor_n_m_s2,
        "drag_1_s": Vehicle.drag_1_s,
        "altitude_loop": "stock",
        "sensors": "true",
        "noise_scale": 1.0,
    }


def test_default_scenario_is_the_table_2_case() -> None:
    """The default scenario gives the same bits as a `Flight` along Table II's trajectory."""
    plain = fly(Flight(Bernoulli(2.0, 0.5), 1.0), PdController())
    assert fly(flight_of([Scenario(duration_s=1.0)], 0.01), PdController()).same_bits(plain)


@pytest.mark.parametrize("controller", ["pd", pytest.param("nmpc", marks=pytest.mark.long)])
def test_a_flight_among_many_is_the_flight_alone(controller: str) -> None:
    """With sensors and all disturbances a flight gives the same bits in any batch, at any position."""

    def digests(*scenarios: Scenario) -> list[str]:
        n = len(scenarios)
        trace = fly(
            flight_of(scenarios, 0.01), PdController() if controller == "pd" else CompiledController(MAMBO, n)
        )
        return [trace.digest(flight) for flight in range(n)]

    hard, calm = (scenario.model_copy(update={"duration_s": 1.3}) for scenario in (HARD, CALM))
    still = calm.model_copy(update={"trajectory": "hover"})
    noisy = hard.model_copy(update={"seed": 9, "noise_scale": 2.0, "dropped_share": 0.4})
    alone = [digests(scenario)[0] for scenario in (hard, calm, still, noisy)]
    assert len(set(alone)) == 4
    assert digests(calm, hard, calm, noisy, still, hard) == [alone[which] for which in (1, 0, 1, 3, 2, 0)]


def test_every_key_of_a_scenario_changes_its_flight() -> None:
    """Flights that differ from the first one in a single key all have different digests."""
    base = HARD.model_copy(update={"duration_s": 1.5})
    other = Scenario(rate_rad_s=0.4)
    of_the_controller = ("fence_m", "fence_time_s")
    keys = [key for key in Scenario.model_fields if key not in (*SHARED_KEYS, *of_the_controller)]
    flown = [base, *(base.model_copy(update={key: getattr(other, key)}) for key in keys)]
    trace = fly(flight_of(flown, 0.01), PdController())
    assert len({trace.digest(flight) for flight in range(trace.flights)}) == len(flown)


def test_curves_of_ones_own_are_taken_as_they_are(tmp_path: Path) -> None:
    """One whose length is 0, in a file or of a program; a file is executed once, whatever sizes are drawn."""
    own = tmp_path / "own.py"
    own.write_text(
        "from pathlib import Path\nfrom mambo_nmpc.curves import Circle\n\n\nclass Empty(Circle):\n"
        "    def __init__(self):\n        super().__init__(3.0, 1.0)\n\n"
        "    def __len__(self):\n        return 0\n\n\n"
        "with Path(__file__).with_suffix('.txt').open('a') as runs:\n    runs.write('.')\n",
        "utf-8",
    )
    drawn = [Scenario(trajectory=f"{own}:Empty", size_m=size_m) for size_m in (1.0, 2.0)]
    assert flight_of(drawn, 0.005).trajectory.target(np.zeros(1))[0, :, 0].tolist() == [3.0, 3.0]
    assert own.with_suffix(".txt").read_text("utf-8") == "."
    curve = load_curve(f"{own}:Empty")[0]
    assert flight_of([Scenario()], 0.005, curve).trajectory is curve


def test_scenarios_that_cannot_share_a_simulation_are_refused() -> None:
    """Scenarios with different sensors, or none at all, raise `FlightError`."""
    with pytest.raises(FlightError, match="sensors must be the same"):
        flight_of([HARD, CALM.model_copy(update={"sensors": "true"})], 0.01)
    with pytest.raises(FlightError, match="flights = 0"):
        flight_of([], 0.01)


@pytest.mark.long
def test_a_record_is_flown_again_with_its_inner_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference repeats a flight of the C bit for bit; a wrong digest or further options fail."""
    trace = fly(flight_of([CALM, HARD], 0.01), CompiledController(MAMBO, 2))
    good = Record(scenario=HARD, settings=MAMBO, trace_sha256=trace.digest(1))
    write_record(good, tmp_path / "good.json")
    write_record(good.model_copy(update={"trace_sha256": "0" * 64}), tmp_path / "other.json")

    monkeypatch.chdir(tmp_path)
    said, _ = run("fly", "--repeat", "good.json", "--no-pictures", "-o", "good")
    assert "the trace equals the recorded one, bit for bit" in said
    k, iterations = len(trace.time_s), MAMBO.optimizer.iterations
    with np.load(tmp_path / "good" / "inner-steps.npz") as inner:
        assert inner["cost"].shape == (k, iterations, 1)
        assert inner["plan_rad"].shape == inner["step_size_rad"].shape == (k, iterations, 1, 2, 2)
    header = (tmp_path / "good" / "trace.csv").read_text().splitlines()[0]
    assert header.endswith(",".join(SEEN_COLUMNS))
    run("fly", "--repeat", "other.json", "--no-pictures", code=1)
    _, refused = run("fly", "--repeat", "good.json", "--seed", "3", code=2)
    assert refused == "--repeat good.json contains the whole flight: leave out --seed\n"
