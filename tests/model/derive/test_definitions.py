"""Derived settings against their definitions: what a drone can do, found by programmes, scans and samples."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import controller_toml
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors
from mambo_sil.model.derive.derived_settings import BRAKING_SHARE, controller_text, derive, wants_exact
from mambo_sil.model.derive.step_response import _answers, fit_steps
from tests.support.derived import settings_for
from tests.support.scenarios import changed

GENERIC = vehicle_toml.preset("generic")
ROUNDED = 5e-3
"""Three digits of a number, relative to it."""


def strong(ratio: float, **sections: Any) -> VehicleFile:
    """Return a drone whose largest thrust is `ratio` times its weight."""
    return changed(GENERIC, altitude={"thrust_max_n": ratio * GENERIC.weight_n}, **sections)


@pytest.mark.parametrize("ratio", [1.05, 1.2, 1.4, 1.6, 3.0])
def test_the_tilt_limit_is_half_the_tilt_that_carries_the_weight(ratio: float) -> None:
    """Found by tilting until the largest thrust no longer does; at most 0.5."""
    drone = strong(ratio)
    tilts_rad = np.linspace(0.0, 1.57, 100_001)
    carries = drone.altitude.thrust_max_n * np.cos(tilts_rad) >= drone.body.mass_kg * GRAVITY_M_S2
    half_rad = tilts_rad[carries].max() / 2
    assert settings_for(drone).limits.tilt_rad == pytest.approx(min(half_rad, 0.5), rel=ROUNDED)


@pytest.mark.parametrize(
    ("gains", "trims_rad"),
    [
        ((0.8, 1.1), (0.03, -0.01)),
        ((0.8, 1.1), (-0.05, 0.02)),
        ((1.2, 0.9), (0.0, -0.04)),
        ((1.0, 1.0), (0.0, 0.0)),
    ],
)
def test_the_braking_is_a_share_of_what_the_tilt_gives(
    gains: tuple[float, float], trims_rad: tuple[float, float]
) -> None:
    """Along the axis and the way that give least, by linear programmes; and the controller takes it."""
    attitude = {
        **{
            name: {"gain": gain, "lag_s": 0.1, "dead_time_s": 0.02}
            for name, gain in zip(("roll", "pitch"), gains, strict=True)
        },
        "acceleration_per_tilt_g": 0.9,
        "roll_trim_rad": trims_rad[0],
        "pitch_trim_rad": trims_rad[1],
    }
    settings = settings_for(changed(GENERIC, attitude=attitude))
    limit_rad, slope, most = settings.limits.tilt_rad, 0.9 * GRAVITY_M_S2, []
    for (gain, trim_rad), sign in itertools.product(zip(gains, trims_rad, strict=True), (1, -1)):
        found = linprog([-sign * slope * gain], bounds=[(-limit_rad, limit_rad)])
        most.append(-found.fun - sign * slope * trim_rad)
    assert settings.limits.braking_m_s2 == pytest.approx(0.65 * min(most), rel=ROUNDED)
    assert settings.limits.speed_m_s == 5.0
    assert (settings.model.roll_gain, settings.model.pitch_gain) == gains
    limiting = method_of(settings).limiting
    assert limiting is not None
    assert limiting.tilted.at(limit_rad) == pytest.approx(min(most), rel=1e-9)
    assert BRAKING_SHARE == 0.65


@pytest.mark.parametrize("rate_hz", [50, 70, 110, 180, 200, 250, 333, 500, 740, 2000])
def test_the_update_period_is_the_nearest_of_all_numbers_of_ticks(rate_hz: int) -> None:
    """To 10 ms."""
    drone = changed(GENERIC, attitude={"rate_hz": rate_hz}, sensors={"position_rate_hz": rate_hz})
    periods_s = [ticks / rate_hz for ticks in range(1, 100)]
    nearest_s = min(periods_s, key=lambda period_s: abs(period_s - 0.01))
    assert settings_for(drone).horizon.update_period_s == pytest.approx(nearest_s)


@pytest.mark.parametrize("rate_hz", [10, 20, 50, 100])
@pytest.mark.parametrize("delay_s", [0.0, 0.03, 0.19])
def test_the_age_is_the_mean_of_that_of_the_newest_position(rate_hz: int, delay_s: float) -> None:
    """At updates every 10 ms, over two seconds; at most 0.2 s, which settings allow."""
    sensors = {"position_rate_hz": rate_hz, "position_delay_s": delay_s}
    held = [update % round(100 / rate_hz) / 100 for update in range(200)]
    expected_s = min(delay_s + sum(held) / len(held), 0.2)
    assert settings_for(changed(GENERIC, sensors=sensors)).observer.measurement_age_s == pytest.approx(
        expected_s, rel=ROUNDED
    )


@pytest.mark.parametrize(("delay_s", "age_s"), [(0.01, 0.01), (0.019, 0.019), (0.021, 0.02), (0.06, 0.02)])
def test_the_age_behind_a_crazyflie_s_filter_is_at_most_20_ms(delay_s: float, age_s: float) -> None:
    """It makes up for the rest by its gyroscope; the settings say so."""
    sensors = {"position_delay_s": delay_s, "estimator": "crazyflie"}
    drone = changed(GENERIC, sensors=sensors)
    assert settings_for(drone).observer.measurement_age_s == age_s
    assert ("by its gyroscope" in controller_text(drone, "x")) == (delay_s > 0.02)


@pytest.mark.parametrize("noise_m", [0.0, 0.0005, 0.00105, 0.002, 0.3, 50.0])
def test_the_noise_of_the_position_is_that_of_the_sensors(noise_m: float) -> None:
    """At least a millimetre, at most the 10 m that settings allow."""
    found = settings_for(changed(GENERIC, sensors={"position_noise_m": noise_m})).observer
    assert found.position_noise == min(max(noise_m, 0.001), 10.0)


@pytest.mark.parametrize("ratio", [1.3, 5.0])
@pytest.mark.parametrize("lag_s", [0.01, 0.08, 0.9])
@pytest.mark.parametrize("dead_time_s", [0.0, 0.15])
def test_the_height_is_what_thrust_and_lag_allow(ratio: float, lag_s: float, dead_time_s: float) -> None:
    """Lag and delay within what settings allow, thrust with a reserve, a descent that is braked."""
    thrust = {"lag_s": lag_s, "dead_time_s": dead_time_s}
    drone = strong(ratio, thrust=thrust, attitude={"rate_hz": 200}, sensors={"position_rate_hz": 100})
    settings = settings_for(drone)
    height = settings.height
    assert height is not None
    assert height.lag_s == pytest.approx(float(np.clip(lag_s, 0.03, 0.5)), rel=ROUNDED)
    assert height.delay_s == pytest.approx(min(dead_time_s + 0.005, 0.1), rel=ROUNDED)
    slow_s = 1.3 * (height.lag_s + height.delay_s)
    assert height.response_time_s == pytest.approx(max(0.1, slow_s), rel=ROUNDED)
    assert height.velocity_weight_s == pytest.approx(min(2.0 * height.response_time_s, 2.0), rel=0.05)
    assert height.disturbance_noise == 1.5
    most_m_s2 = min(0.95 * drone.altitude.thrust_max_n / drone.body.mass_kg, 100.0)
    assert height.thrust_max_m_s2 == pytest.approx(most_m_s2, rel=ROUNDED)
    assert height.thrust_min_m_s2 == pytest.approx(0.3 * GRAVITY_M_S2, rel=0.02)
    swing_m_s2 = height.thrust_max_m_s2 - height.thrust_min_m_s2
    assert settings.guard is not None
    assert settings.guard.thrust_budget_m_s2 == pytest.approx(swing_m_s2, rel=ROUNDED)
    assert settings.guard.thrust_budget_m_s3 == pytest.approx(8.0 * swing_m_s2, rel=ROUNDED)
    constants = method_of(settings)
    braked_m_s = getattr(constants, "height").most_m_s[1]  # noqa: B009 - of the quadratic cost only
    assert height.descent_m_s <= braked_m_s
    assert height.descent_m_s == pytest.approx(
        min(1.5, 0.265 * (height.thrust_max_m_s2 - GRAVITY_M_S2)), rel=0.01
    )


@pytest.mark.parametrize(("largest_m_s2", "has"), [(11.3, False), (11.45, True)])
def test_a_drone_that_hardly_climbs_has_no_height(largest_m_s2: float, has: bool) -> None:
    """Where less than 10.8 m/s^2 are left of its thrust, with the reserve, the section would be refused."""
    thrust_max_n = largest_m_s2 * GENERIC.body.mass_kg
    drone = changed(GENERIC, thrust={"lag_s": 0.1}, altitude={"thrust_max_n": thrust_max_n})
    assert (settings_for(drone).height is not None) is has


@pytest.mark.parametrize("lags_s", [(0.05, 0.4), (0.3, 0.1), (0.02, 0.03), (2.0, 2.0)])
def test_the_response_time_is_the_mean_of_both_axes(lags_s: tuple[float, float]) -> None:
    """Of lag plus dead time; at least 0.1 s, at most 2 s."""
    axes = {
        name: {"gain": 1.0, "lag_s": lag_s, "dead_time_s": 0.02}
        for name, lag_s in zip(("roll", "pitch"), lags_s, strict=True)
    }
    mean_s = np.mean([lag_s + 0.02 for lag_s in lags_s])
    settings = settings_for(changed(GENERIC, attitude=axes))
    assert settings.cost.response_time_s == pytest.approx(np.clip(mean_s, 0.1, 2.0), rel=ROUNDED)
    assert (settings.model.roll_lag_s, settings.model.pitch_lag_s) == lags_s
    assert math.isclose(settings.model.roll_delay_s, 0.02)


@pytest.mark.parametrize(("wanted_m_s2", "braking_m_s2"), [(0.2, 0.2), (0.095, 0.128)])
def test_the_least_braking_is_that_of_the_least_tilt(wanted_m_s2: float, braking_m_s2: float) -> None:
    """0.02 rad: a drone that can hardly lift itself has limits too."""
    half_rad = wanted_m_s2 / (0.65 * GRAVITY_M_S2)
    limits = settings_for(strong(1.0 / math.cos(2.0 * half_rad))).limits
    assert limits.braking_m_s2 == pytest.approx(braking_m_s2, rel=ROUNDED)
    assert limits.speed_m_s == 5.0


@pytest.mark.parametrize("largest_m_s2", [30.0, 51.0, 54.0, 130.5])
def test_every_thrust_of_a_drone_is_in_the_range(largest_m_s2: float) -> None:
    """The next whole number of m/s^2 above the largest; the default where that is enough."""
    drone = changed(GENERIC, altitude={"thrust_max_n": largest_m_s2 * GENERIC.body.mass_kg})
    found = settings_for(drone).ranges.thrust_acceleration_max_m_s2
    assert found >= largest_m_s2 - 1e-9
    assert (
        found < largest_m_s2 + 1.0
        or found == type(settings_for(GENERIC).ranges)().thrust_acceleration_max_m_s2
    )


def test_the_model_is_the_fit_of_each_axis() -> None:
    """Of a drone whose inner loops are known, with three digits: lag, delay, integral part."""
    drone = vehicle_toml.preset("mambo")
    model = settings_for(drone).model
    roll, pitch = fit_steps(drone)
    for name, fit in (("roll", roll), ("pitch", pitch)):
        for key, value in (
            ("lag_s", fit.lag_s),
            ("delay_s", fit.delay_s),
            ("integral_1_s", fit.integral_1_s),
        ):
            assert getattr(model, f"{name}_{key}") == pytest.approx(value, rel=ROUNDED)
    assert roll.lag_s != pytest.approx(pitch.lag_s, rel=0.1)


def test_the_answer_to_a_step_begins_at_0_and_ends_at_1() -> None:
    """Of roll and pitch, each to its own command, over three seconds of the simulation's ticks."""
    drone = vehicle_toml.preset("mambo")
    answers = _answers(drone)
    assert answers.shape == (2, round(3.0 / drone.step_s) + 1)
    assert answers[:, 0].tolist() == [0.0, 0.0]
    assert answers[:, -1] == pytest.approx([1.0, 1.0], abs=0.03)
    assert np.argmax(answers[1] > 0.5) < np.argmax(answers[0] > 0.5), "pitch is quicker"


def test_a_drone_without_sensors_is_calm() -> None:
    """With the noise of a filtered velocity, as with motion capture, and a third of its disturbance."""
    seen = vehicle_toml.preset("generic").model_dump(exclude={"sensors"})
    blind = settings_for(VehicleFile.model_validate(seen)).observer
    captured = settings_for(GENERIC).observer
    assert blind.velocity_noise == captured.velocity_noise == 0.15
    assert (blind.disturbance_noise, captured.disturbance_noise) == (1.0, 3.0)
    assert blind.position_noise == type(blind)().position_noise


def test_the_true_state_has_a_quick_observer() -> None:
    """Without noise and age, whether the file says it or an option."""
    true = settings_for(GENERIC.with_sensors("true")).observer
    assert (true.position_noise, true.velocity_noise, true.disturbance_noise) == (0.001, 0.02, 3.0)
    assert true.measurement_age_s == 0.0
    said = VehicleFile.model_validate(GENERIC.model_dump() | {"sensors": {"kind": "true"}})
    assert settings_for(said).observer == true
    assert GENERIC.with_sensors("mocap") == GENERIC
    with pytest.raises(
        InvalidSettingsError, match=r'^sensors = "mambo" needs its figures, \[sensors\], in the file'
    ):
        GENERIC.with_sensors("mambo")


def test_a_flow_deck_has_a_noise_of_its_own() -> None:
    """Of the position; velocity and disturbance as with motion capture; as old as a frame of 10 ms."""
    seen = GENERIC.model_dump() | {"sensors": {"kind": "flow-deck"}}
    deck = settings_for(VehicleFile.model_validate(seen)).observer
    captured = settings_for(GENERIC).observer
    assert (deck.velocity_noise, deck.disturbance_noise) == (
        captured.velocity_noise,
        captured.disturbance_noise,
    )
    assert deck.position_noise > 10 * captured.position_noise
    assert deck.measurement_age_s == 0.01


@pytest.mark.parametrize("ratio", [1.2, 2.6, 11.0])
def test_more_tilt_is_of_use_where_the_height_is_held(ratio: float) -> None:
    """Never without a known thrust, nor behind a Mambo's optical flow."""
    mambo = vehicle_toml.preset("mambo")
    flowing = changed(mambo, altitude={"thrust_max_n": ratio * mambo.weight_n})
    assert wants_exact(strong(ratio, thrust={"lag_s": 0.05}))
    assert not wants_exact(strong(ratio))
    assert not wants_exact(flowing)


@pytest.mark.parametrize("share", [0.5, 0.6, 0.7])
@pytest.mark.parametrize("ratio", [1.6, 2.6, 10.0])
def test_exact_settings_have_a_share_of_the_possible_tilt(ratio: float, share: float) -> None:
    """And brake as small angles do, whose limit is half of it, at most 0.5."""
    drone = strong(ratio, thrust={"lag_s": 0.05})
    exact = controller_toml.parse(controller_text(drone, "mine", exact_share=share), "mine")
    small = settings_for(drone)
    assert (exact.model.tilt, small.model.tilt) == ("exact", "small-angle")
    possible_rad = math.acos(1.0 / ratio)
    assert exact.limits.tilt_rad == pytest.approx(share * possible_rad, rel=ROUNDED)
    assert small.limits.tilt_rad == pytest.approx(min(0.5 * possible_rad, 0.5), rel=ROUNDED)
    braking_rad = min(exact.limits.tilt_rad, 0.5)
    assert exact.limits.braking_m_s2 == pytest.approx(
        BRAKING_SHARE * GRAVITY_M_S2 * braking_rad, rel=2.0 * ROUNDED
    )
    assert exact.guard is not None
    assert exact.guard.tilt_budget_rad == pytest.approx(3.0 * exact.limits.tilt_rad, rel=2.0 * ROUNDED)
    assert exact.guard.tilt_budget_rad_s == pytest.approx(12.0 * exact.limits.tilt_rad, rel=2.0 * ROUNDED)


def test_a_drone_that_can_hardly_lift_itself_has_the_least_tilt() -> None:
    """That brakes as settings want it."""
    assert settings_for(strong(1.00001)).limits.tilt_rad == 0.02


@pytest.mark.parametrize("gain", [0.8, 1.0, 1.1])
def test_the_gain_of_the_thrust_is_that_of_the_file(gain: float) -> None:
    """1, the default, is not written."""
    drone = strong(2.0, thrust={"lag_s": 0.06, "gain": gain})
    height = settings_for(drone).height
    assert height is not None
    assert height.thrust_gain == gain
    assert ("thrust_gain" in controller_text(drone, "mine")) is (gain != 1.0)


def test_the_estimator_of_an_autopilot_is_believed_slowly() -> None:
    """Its velocity least of all; figures of it are not needed."""
    observer = settings_for(GENERIC.with_sensors("autopilot")).observer
    captured = settings_for(GENERIC).observer
    assert observer.velocity_noise > 5.0 * captured.velocity_noise
    assert observer.disturbance_noise < 0.2 * captured.disturbance_noise
    assert observer.position_noise > 10.0 * captured.position_noise


@pytest.mark.parametrize(
    ("error_m_s", "position_m", "velocity_m_s", "disturbance_m_s3"),
    [
        (0.24, 0.03, 1.0, 0.5),
        (0.12, 0.03, 1.0, 0.5),
        (0.06, 0.00945, 0.397, 1.26),
        (0.03, 0.00298, 0.157, 3.17),
        (0.0, 0.00298, 0.157, 3.17),
    ],
)
def test_an_estimator_that_errs_less_is_believed_sooner(
    error_m_s: float, position_m: float, velocity_m_s: float, disturbance_m_s3: float
) -> None:
    """Down to a quarter of EKF2's error, where the noise is about that for motion capture."""
    sensors = AutopilotSensors(velocity_error_m_s=error_m_s)
    observer = settings_for(GENERIC.model_copy(update={"sensors": sensors})).observer
    found = observer.position_noise, observer.velocity_noise, observer.disturbance_noise
    assert found == (position_m, velocity_m_s, disturbance_m_s3)


@pytest.mark.parametrize(("error_m_s", "as_ekf2"), [(0.12, True), (0.1, False), (0.03, False)])
def test_the_reasons_behind_an_estimator_fit_its_error(error_m_s: float, as_ekf2: bool) -> None:
    """Decimetres a second and wind within a second are EKF2's alone; others are compared with it."""
    sensors = AutopilotSensors(velocity_error_m_s=error_m_s)
    found = derive(GENERIC.model_copy(update={"sensors": sensors}))
    words = {one.key: one.reason for one in found if one.section == "observer"}
    assert ("decimetres a second" in words["velocity_noise"]) == as_ekf2
    assert ("within a second" in words["disturbance_noise"]) == as_ekf2
    assert ("by centimetres" in words["position_noise"]) == as_ekf2
    ends = [words[key].endswith("by sensors.velocity_error_m_s") for key in words if key.endswith("_noise")]
    assert ends == [not as_ekf2] * 3
