"""Settings derived from a drone: they fly it well at every heading, and what they have not is explained."""

import math
from typing import Final

import numpy as np
import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import DEFAULT_SENSORS, CurveName
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.model.derive.derived_margins import missing_height
from mambo_sil.model.derive.derived_settings import controller_text, derive
from mambo_sil.model.derive.step_response import fit_steps
from tests.support.derived import settings_for
from tests.support.scenarios import CRAZYFLIE, FLOWN, changed

GENERIC: Final = vehicle_toml.preset("generic")
HEADINGS: Final = 8
SIZES: Final[dict[CurveName, tuple[float, float]]] = {
    "bernoulli": (2.0, 0.5),
    "circle": (1.0, 1.5),
    "step": (1.0, 0.0),
}
"""Size in m and rate in rad/s of the curves flown."""


def flown(settings: Settings, drone: VehicleFile, curve: CurveName, *, noisy: bool) -> Trace:
    """Return 20 s of a curve at headings around the whole turn, none of which may crash."""
    size_m, rate_rad_s = SIZES[curve]
    scenarios = [
        Scenario(
            vehicle=drone,
            trajectory=curve,
            size_m=size_m,
            rate_rad_s=rate_rad_s,
            duration_s=20.0,
            yaw_rad=2.0 * math.pi * number / HEADINGS,
            sensors=DEFAULT_SENSORS[drone.sensors.kind] if noisy else "true",
            seed=number,
        )
        for number in range(HEADINGS)
    ]
    flight = flight_of(scenarios, settings.horizon.update_period_s)
    trace = fly(flight, CompiledController(settings, HEADINGS))
    assert not detect_crashes(trace, drone).any()
    return trace


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", vehicle_toml.names())
def test_a_shipped_drone_flies_well_with_them(name: str) -> None:
    """Both figures and a step, at every heading, seeing the truth and through its sensors.

    The drift of the Mambo's own estimates counts as error: more is allowed with them.
    """
    drone = vehicle_toml.preset(name)
    settings = settings_for(drone)
    for noisy, most in ((False, 0.6), (True, 1.8 if name == "mambo" else 0.35)):
        eight = measure(flown(settings, drone, "bernoulli", noisy=noisy))
        circle = measure(flown(settings, drone, "circle", noisy=noisy))
        assert eight.iae_m_s.max() < most
        assert circle.iae_m_s.max() < 2.0 * most
        assert max(eight.command_variation_rad.max(), circle.command_variation_rad.max()) < 0.017
        step = measure(flown(settings, drone, "step", noisy=noisy), start_s=5.0)
        assert step.rms_error_m.max() < (0.35 if noisy and name == "mambo" else 0.02)


@pytest.mark.parametrize("name", ["crazyflie-flown", "generic"])
def test_they_are_better_than_those_of_another_drone(name: str) -> None:
    """On a drone without a preset of its own, no preset flies the circle through noise as closely."""
    drone = vehicle_toml.preset(name)
    own = measure(flown(settings_for(drone), drone, "circle", noisy=True)).iae_m_s.max()
    for other in ("mambo", "crazyflie"):
        foreign = measure(flown(presets.load(other), drone, "circle", noisy=True)).iae_m_s.min()
        assert own < foreign


def test_the_attitude_model_is_that_of_the_loops() -> None:
    """Of the stock loops, whose equation it solves: integral over angle gain, and next to nothing left."""
    roll, pitch = fit_steps(vehicle_toml.preset("mambo"))
    assert roll.integral_1_s == pytest.approx(1.0, rel=0.1)
    assert roll.lag_s + roll.delay_s == pytest.approx(0.28, abs=0.01)
    assert pitch.lag_s + pitch.delay_s == pytest.approx(0.158, abs=0.01)
    assert max(roll.error, pitch.error) < 0.01


def test_a_loop_without_integrator_gets_none() -> None:
    """Its model has three parameters fewer to be wrong."""
    axes = {
        name: {**getattr(CRAZYFLIE.attitude, name).model_dump(), "i_1_s2": 0.0, "rate_i_1_rad": 0.0}
        for name in ("roll", "pitch")
    }
    assert all(fit.integral_1_s == 0.0 for fit in fit_steps(changed(CRAZYFLIE, attitude=axes)))


def test_a_loop_whose_step_an_integrator_would_fit_better_gets_none_either() -> None:
    """A PD with an overshoot: what mends the shape of the step would leave a circle by 6 mm."""
    inertia_kg_m2 = 0.003
    roll = {"p_n_m": 200.0 * inertia_kg_m2, "d_n_m_s": 24.0 * inertia_kg_m2}
    hummingbird = vehicle_toml.preset("hummingbird")
    gains = hummingbird.attitude.model_dump() | {"roll": roll, "pitch": roll}
    body = hummingbird.body.model_dump() | {f"inertia_{axis}_kg_m2": inertia_kg_m2 for axis in "xy"}
    document = hummingbird.model_dump(exclude_none=True) | {"attitude": gains, "body": body}
    drone = VehicleFile.model_validate(document)
    assert [fit.integral_1_s for fit in fit_steps(drone)] == [0.0, 0.0]
    trace = flown(settings_for(drone.with_sensors("true")), drone, "circle", noisy=False)
    late = trace.time_s > 8.0
    off_m = np.abs(trace.position_m[late, :, :2] - trace.target[late, :, :2]).max()
    assert off_m < 0.003


def test_a_first_order_drone_is_copied() -> None:
    """Gain, lag, dead time, acceleration per tilt and drag are those of the file."""
    drone = vehicle_toml.preset("crazyflie-flown")
    model = settings_for(drone).model
    for each in (model.roll_gain, model.pitch_gain):
        assert each == 0.82
    assert (model.roll_lag_s, model.pitch_delay_s, model.drag_1_s) == (0.047, 0.091, 0.15)
    assert model.acceleration_per_tilt == 0.87
    assert "trim" not in controller_text(drone, "crazyflie-flown")
    trimmed = settings_for(changed(drone, attitude={"roll_trim_rad": 0.01, "pitch_trim_rad": -0.02})).model
    assert (trimmed.roll_trim_rad, trimmed.pitch_trim_rad) == (0.01, -0.02)


def test_the_height_is_that_of_drones_whose_thrust_is_known() -> None:
    """By rotors; not of another."""
    height = settings_for(CRAZYFLIE).height
    assert height is not None
    assert (height.lag_s, height.delay_s) == (0.072, 0.005)
    assert (height.response_time_s, height.velocity_weight_s) == (0.1, 0.2)
    assert (height.thrust_min_m_s2, height.thrust_max_m_s2) == (2.9, 15.2)
    mambo = settings_for(vehicle_toml.preset("mambo")).height
    assert mambo is not None
    assert (mambo.lag_s, mambo.thrust_max_m_s2, mambo.descent_m_s) == (0.03, 18.1, 1.5)
    assert settings_for(GENERIC).height is None


@pytest.mark.first_is_quick
@pytest.mark.parametrize("gain", [0.3, 0.1, 1.5])
def test_the_gain_of_the_thrust_is_that_of_the_file(gain: float) -> None:
    """Whatever a drone delivers for a command, it flies as one that delivers what is commanded."""
    document = GENERIC.model_dump(exclude_none=True, exclude={"altitude"})
    exact, other = (
        VehicleFile.model_validate(document | {"thrust": {"gain": value, "lag_s": 0.137}})
        for value in (1.0, gain)
    )
    height = settings_for(other).height
    assert height is not None
    assert (height.thrust_gain, height.thrust_max_m_s2) == (gain, 18.6)
    expected, found = (flown(settings_for(one), one, "circle", noisy=True) for one in (exact, other))
    assert found.position_m == pytest.approx(expected.position_m, abs=1e-3)
    assert abs(found.position_m[1000:, :, 2] + HOVER_HEIGHT_M).max() < 0.01


@pytest.mark.parametrize("rate_hz", [50, 200, 2000])
@pytest.mark.parametrize("ratio", [1.17, 1.5, 2.0, 12.0])
@pytest.mark.parametrize("lag_s", [0.001, 0.1, 2.0])
def test_every_height_is_one_that_a_controller_can_have(lag_s: float, ratio: float, rate_hz: int) -> None:
    """Whatever the lag, the thrust and the rate: the climb and the descent are braked in time."""
    thrust = {"lag_s": lag_s, "dead_time_s": lag_s / 10.0}
    strong = {"thrust_max_n": ratio * GENERIC.weight_n}
    sensors, attitude = {"position_rate_hz": 50}, {"rate_hz": rate_hz}
    drone = changed(GENERIC, thrust=thrust, altitude=strong, attitude=attitude, sensors=sensors)
    assert settings_for(drone).height is not None


def test_the_thrust_of_the_crazyflie_bounds_its_tilt() -> None:
    """0.12 N a motor, as its firmware has it, 0.2 N of the Brushless: less than the bound of the model."""
    for name, tilt_rad in (("crazyflie", 0.455), ("crazyflie-l250", 0.432), ("crazyflie-brushless", 0.491)):
        assert settings_for(vehicle_toml.preset(name)).limits.tilt_rad == tilt_rad


def test_the_disturbance_is_at_most_what_a_setting_may_be() -> None:
    """Of a drone that tilts by twice the command; of one that hardly lifts itself less than the default."""
    strong = changed(
        FLOWN, attitude={"roll": {"gain": 2.0}, "pitch": {"gain": 2.0}, "acceleration_per_tilt_g": 1.4}
    )
    most = settings_for(strong).observer.disturbance_limit_m_s2
    weak = settings_for(changed(CRAZYFLIE, altitude={"thrust_max_n": 1.05 * CRAZYFLIE.weight_n}))
    assert (most, weak.observer.disturbance_limit_m_s2) == (20.0, 1.53)


def test_the_instruments_of_the_mambo_have_the_defaults_of_its_preset() -> None:
    """And its optical flow lowers the tilt limit, for which its thrust would allow more."""
    found = settings_for(vehicle_toml.preset("mambo"))
    limit_m_s2 = found.observer.disturbance_limit_m_s2
    assert found.observer == type(found.observer)(disturbance_limit_m_s2=limit_m_s2)
    assert found.limits.tilt_rad == 0.35


@pytest.mark.long
def test_every_value_has_its_reason() -> None:
    """As a comment above it."""
    lines = controller_text(CRAZYFLIE, "crazyflie").splitlines()
    keys = [number for number, line in enumerate(lines) if " = " in line and not line.startswith("#")]
    assert len(keys) == len(derive(CRAZYFLIE))
    assert all(lines[number - 1].startswith("# ") for number in keys)


def test_an_unknown_thrust_is_named_with_what_it_costs() -> None:
    """The statics of its altitude loop of 15 1/s^2: 0.2 x 9.81 over it, and 0.05 x 9.81."""
    said = missing_height(FLOWN)
    assert "sinks by 131 mm under 20 % more mass, by 33 mm with 5 % less thrust" in said
    assert said.endswith("write [thrust] with lag_s and gain into its file")


@pytest.mark.parametrize(("gain_n_m", "cost"), [(0.9, "65 mm"), (0.0, "")])
def test_the_cost_follows_the_gain(gain_n_m: float, cost: str) -> None:
    """Twice the gain, half of it; a loop without gain holds no height at all."""
    altitude = {"p_n_m": gain_n_m, "d_n_s_m": 0.21, "thrust_max_n": 0.575}
    said = missing_height(changed(FLOWN, altitude=altitude))
    assert cost in said
    assert ("sinks" in said) == (gain_n_m > 0.0)


def test_a_thrust_that_hardly_lifts_is_named() -> None:
    """A known one, of 1.05 times the weight."""
    altitude = {"p_n_m": 0.45, "d_n_s_m": 0.21, "thrust_max_n": 0.309}
    said = missing_height(changed(FLOWN, altitude=altitude, thrust={"lag_s": 0.1}))
    assert "the largest thrust, 10.3 m/s^2, hardly climbs" in said
