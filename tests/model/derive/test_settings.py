"""Settings derived from a drone: they fly it well at every heading, and each follows from its file."""

import math
from functools import lru_cache
from typing import Final

import pytest

from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import SENSORS_OF, CurveName
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.model.derive.derived_settings import controller_text, derive
from mambo_sil.model.derive.step_response import fit_steps
from tests.support.scenarios import CRAZYFLIE, changed

GENERIC: Final = vehicle_toml.preset("generic")
HEADINGS: Final = 8
SIZES: Final[dict[CurveName, tuple[float, float]]] = {
    "bernoulli": (2.0, 0.5),
    "circle": (1.0, 1.5),
    "step": (1.0, 0.0),
}
"""Size in m and rate in rad/s of the curves flown."""


@lru_cache
def settings_for(drone: VehicleFile) -> Settings:
    """Return the settings in the file that is written for a drone."""
    return controller_toml.parse(controller_text(drone, drone.name), drone.name)


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
            sensors=SENSORS_OF[drone.sensors.kind][-1] if noisy else "true",
            seed=number,
        )
        for number in range(HEADINGS)
    ]
    flight = flight_of(scenarios, settings.horizon.update_period_s)
    trace = fly(flight, CompiledController(settings, HEADINGS))
    assert not detect_crashes(trace, drone).any()
    return trace


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
    """By rotors or by its response; not of another, nor of one that hardly climbs."""
    height = settings_for(CRAZYFLIE).height
    assert height is not None
    assert (height.lag_s, height.delay_s) == (0.072, 0.005)
    assert (height.response_time_s, height.velocity_weight_s) == (0.1, 0.2)
    assert (height.thrust_min_m_s2, height.thrust_max_m_s2) == (2.9, 15.2)
    mambo = settings_for(vehicle_toml.preset("mambo")).height
    assert mambo is not None
    assert (mambo.lag_s, mambo.thrust_max_m_s2, mambo.descent_m_s) == (0.03, 18.1, 1.5)
    assert settings_for(GENERIC).height is None
    slow = settings_for(changed(GENERIC, thrust={"lag_s": 0.1, "dead_time_s": 0.04})).height
    assert slow is not None
    assert (slow.lag_s, slow.delay_s, slow.response_time_s) == (0.1, 0.045, 0.189)
    weak = {"thrust_max_n": 1.15 * GENERIC.weight_n}
    assert settings_for(changed(GENERIC, thrust={"lag_s": 0.1}, altitude=weak)).height is None


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


@pytest.mark.parametrize(("ratio", "tilt_rad"), [(1.05, 0.155), (1.3, 0.347), (1.9, 0.5), (9.0, 0.5)])
def test_the_tilt_limit_leaves_thrust_for_the_weight(ratio: float, tilt_rad: float) -> None:
    """At the limit of both angles the largest thrust still carries the drone."""
    drone = changed(GENERIC, altitude={"thrust_max_n": ratio * GENERIC.weight_n})
    limit_rad = settings_for(drone).limits.tilt_rad
    assert limit_rad == tilt_rad
    assert math.cos(limit_rad) ** 2 * ratio > 1.0


@pytest.mark.parametrize(
    ("rate_hz", "period_s"),
    [(200, 0.01), (500, 0.01), (250, 0.008), (333, 3 / 333), (50, 0.02), (2000, 0.01)],
)
def test_the_update_period_is_a_whole_number_of_ticks(rate_hz: int, period_s: float) -> None:
    """So that any drone can be flown with its settings."""
    drone = changed(GENERIC, attitude={"rate_hz": rate_hz}, sensors={"position_rate_hz": rate_hz})
    assert settings_for(drone).horizon.update_period_s == period_s


@pytest.mark.parametrize(("lag_s", "response_s"), [(0.001, 0.1), (0.1, 0.13), (2.0, 2.0)])
def test_the_response_time_follows_the_lags(lag_s: float, response_s: float) -> None:
    """Within what the settings allow, whatever the drone; and the loop is stable, or they were refused."""
    axis = {"gain": 1.0, "lag_s": lag_s, "dead_time_s": 0.03}
    assert (
        settings_for(changed(GENERIC, attitude={"roll": axis, "pitch": axis})).cost.response_time_s
        == response_s
    )


def test_the_observer_follows_the_sensors() -> None:
    """Noise and age of motion capture; those of the Mambo are the defaults."""
    late = changed(GENERIC, sensors={"position_rate_hz": 20, "position_noise_m": 0.005})
    observer = settings_for(late).observer
    assert (observer.position_noise, observer.age_s) == (0.005, 0.03)
    assert settings_for(GENERIC).observer.age_s == 0.01
    assert settings_for(vehicle_toml.preset("mambo")).observer == type(observer)()


def test_the_thrust_of_the_crazyflie_bounds_its_tilt() -> None:
    """0.12 N a motor, as its firmware has it, 0.2 N of the Brushless: less than the bound of the model."""
    for name, tilt_rad in (("crazyflie", 0.455), ("crazyflie-l250", 0.432), ("crazyflie-brushless", 0.491)):
        assert settings_for(vehicle_toml.preset(name)).limits.tilt_rad == tilt_rad


@pytest.mark.parametrize(
    ("name", "braking_m_s2"), [("mambo", 2.23), ("crazyflie", 2.9), ("crazyflie-flown", 2.27)]
)
def test_the_braking_follows_from_the_tilt_limit(name: str, braking_m_s2: float) -> None:
    """0.65 of gravity times tilt, gain and acceleration per tilt; the speed is 5 m/s."""
    limits = settings_for(vehicle_toml.preset(name)).limits
    assert (limits.speed_m_s, limits.braking_m_s2) == (5.0, braking_m_s2)


def test_a_trim_takes_its_share_of_the_braking() -> None:
    """Along the axis that it hinders, so that the braking is never more than settings allow."""
    drone = vehicle_toml.preset("crazyflie-flown")
    trimmed = settings_for(changed(drone, attitude={"roll_trim_rad": 0.05, "pitch_trim_rad": -0.1})).limits
    share = 1.0 - 0.1 / (0.82 * trimmed.tilt_rad)
    both_rounded = 0.005 * (1.0 + share)
    assert trimmed.braking_m_s2 == pytest.approx(
        share * settings_for(drone).limits.braking_m_s2, abs=both_rounded
    )


def test_a_drone_that_can_hardly_tilt_has_no_limits() -> None:
    """Where the braking would be less than the least that settings allow."""
    weak = changed(GENERIC, altitude={"thrust_max_n": 1.0001 * GENERIC.weight_n})
    assert settings_for(weak).limits.speed_m_s == 0.0


def test_optical_flow_lowers_the_tilt_limit() -> None:
    """To that of the preset for the Mambo, whose thrust would allow more."""
    assert settings_for(vehicle_toml.preset("mambo")).limits.tilt_rad == 0.35


def test_a_strong_drone_may_use_its_thrust() -> None:
    """A thrust beyond the default range would be refused at every step."""
    strong = changed(GENERIC, altitude={"thrust_max_n": 0.1 * 70.2})
    assert settings_for(strong).ranges.thrust_acceleration_max_m_s2 == 71.0


@pytest.mark.long
def test_every_value_has_its_reason() -> None:
    """As a comment above it."""
    lines = controller_text(CRAZYFLIE, "crazyflie").splitlines()
    keys = [number for number, line in enumerate(lines) if " = " in line and not line.startswith("#")]
    assert len(keys) == len(derive(CRAZYFLIE))
    assert all(lines[number - 1].startswith("# ") for number in keys)
