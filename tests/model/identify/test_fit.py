"""What the fits find in logs with a known truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.experiment.margins.corners import at_ends, corners
from mambo_sil.model.identify.identify import identify
from mambo_sil.model.identify.identify_record import IdentifySummary, motion_rows
from mambo_sil.model.identify.identify_report import model_text, vehicle_text
from mambo_sil.model.identify.motion import Motion, fit_motion
from mambo_sil.model.identify.response import AxisParameters, Interval, filter_command
from mambo_sil.model.identify.segments import cut
from mambo_sil.results.terminal import result_text
from tests.support.logs import NAMES, Array, Flown, Truth, drop_and_jitter, filter_velocity, fly, log_of

TRUTH = Truth()
FLIGHTS = 20
"""Flights of each kind whose intervals, of two axes each, are held against the truth."""


@pytest.mark.parametrize("samples", [1, 2, 1000])
@pytest.mark.parametrize(("top", "bottom"), [([0.05], [1.0, -0.95]), ([0.3, -0.2], [1.0, -1.5, 0.6])])
def test_the_filter_is_that_of_scipy(samples: int, top: list[float], bottom: list[float]) -> None:
    """In steady state before its first command."""
    command = 2.0 + np.cumsum(np.random.default_rng(samples).normal(size=samples))
    expected, _ = lfilter(top, bottom, command, zi=lfilter_zi(top, bottom) * command[0])
    answer = filter_command(np.array(top), np.array(bottom), command)
    np.testing.assert_allclose(answer, expected, rtol=1e-11)


def found(*logs: dict[str, Array]) -> IdentifySummary:
    """Identify logs."""
    return identify([log_of(each, f"log{number}.csv") for number, each in enumerate(logs)])[0]


def motion_of(*logs: dict[str, Array]) -> Motion:
    """Fit the motion alone, which takes a fifth of the time."""
    return fit_motion([segment for each in logs for segment in cut(log_of(each))])


def fits(summary: IdentifySummary) -> list[AxisParameters]:
    """Return the fits of roll and pitch."""
    return [fit for axis in summary.axes.values() if (fit := axis.fitted)]


def demand_truth(summary: IdentifySummary, truth: Truth) -> None:
    """Demand lag plus dead time within 10 ms and the gain within 0.02 on both axes."""
    assert len(fits(summary)) == 2
    for axis, fit in enumerate(fits(summary)):
        assert abs(fit.sum_s.value - truth.lag_s[axis] - truth.delay_s[axis]) < 0.010
        assert abs(fit.gain.value - truth.gain[axis]) < 0.02


@pytest.mark.first_is_quick
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_thirty_seconds_of_the_figure_of_eight_suffice(seed: int) -> None:
    """With noise, gusts and 10 % lost rows, wrong times and another zero of time; motion and trim, too."""
    flown = fly(TRUTH, Flown(), 1, seed)[0]
    random = np.random.default_rng(seed)
    for log in (flown, drop_and_jitter(flown, random)):
        summary = found(log)
        demand_truth(summary, TRUTH)
        assert [axis.verdict for axis in summary.axes.values()] == ["good", "good"]
        assert [fit.integral_1_s for fit in fits(summary)] == [None, None]
        assert summary.motion is not None
        assert abs(summary.motion.acceleration_per_tilt.value - TRUTH.acceleration_per_tilt) < 0.04
        assert abs(summary.motion.drag_1_s.value - TRUTH.drag_1_s) < 0.08
        for trim, truth in zip(summary.motion.trim_rad, TRUTH.trim_rad, strict=True):
            assert abs(trim.value - truth) < 0.01


@pytest.mark.long
def test_one_frequency_cannot_tell_lag_from_dead_time() -> None:
    """Their sum and the gain are found; the interval of the lag says so, and the verdict is weak."""
    time_s, lag_s = 0.01 * np.arange(3000.0), 0.14
    random = np.random.default_rng(1)
    phase = 1.2 * (time_s - 0.005)
    command = 0.1 * np.sin(phase + 0.006)
    share = 1.0 / (1.0 + (1.2 * lag_s) ** 2)
    later = phase - 1.2 * 0.03
    tilt = 0.1 * share * (np.sin(later) - 1.2 * lag_s * np.cos(later)) + 0.002 * random.normal(size=3000)
    log = {"time_s": time_s, "roll_command_rad": command, "pitch_command_rad": command}
    summary = found(log | {"roll_rad": tilt, "pitch_rad": tilt})
    for axis, fit in zip(summary.axes.values(), fits(summary), strict=True):
        assert axis.verdict == "weak"
        assert any("the lag is known within" in reason for reason in axis.reasons)
        assert abs(fit.gain.value - 1.0) < fit.gain.within < 0.05
        assert abs(fit.sum_s.value - lag_s - 0.03) < fit.sum_s.within < 0.02
        assert not fit.split_is_known
        for one in (fit.lag_s, fit.delay_s):
            assert one.value - one.within <= 0.0
            assert one.value + one.within >= fit.sum_s.value
    said = " ".join(result_text(summary.result(Path())).split())
    assert "lag, ms not known not known dead time, ms not known not known" in said
    assert "roll: only the sum of lag and dead time is known, not how it splits" in said
    for text in (vehicle_text(summary, 0.5), model_text(summary)):
        assert text.count("how it splits is not known") == 2
    drone = vehicle_toml.parse(vehicle_text(summary, 0.5), "mine", "mine.toml")
    assert drone.uncertainty is not None
    assert drone.uncertainty.roll_lag_s is None
    assert isinstance(drone.attitude, FirstOrderAttitude)
    for ends in corners(drone):
        moved = at_ends(drone, ends).attitude
        assert isinstance(moved, FirstOrderAttitude)
        for response, fit in zip((moved.roll, moved.pitch), fits(summary), strict=True):
            assert abs(response.lag_s + response.dead_time_s - fit.sum_s.value) < fit.sum_s.within + 0.002


@pytest.mark.parametrize(
    "truth",
    [
        Truth(gain=(1.0, 1.0), lag_s=(0.14, 0.15), delay_s=(0.03, 0.02)),
        Truth(gain=(0.7, 1.2), lag_s=(0.25, 0.02), delay_s=(0.005, 0.1)),
    ],
)
def test_other_drones_are_found_as_well(truth: Truth) -> None:
    """Slow ones, quick ones, and one whose axes differ."""
    demand_truth(found(fly(truth, Flown(), 1)[0]), truth)


def test_a_heading_that_turns_is_told_from_one_that_does_not() -> None:
    """Tilt and motion are related by yaw; yaw is only needed for the motion."""
    turning = fly(TRUTH, Flown(yaw_rate_rad_s=0.1), 1)[0]
    summary = found(turning)
    demand_truth(summary, TRUTH)
    assert summary.motion is not None
    assert not any("sense of yaw" in remark for remark in summary.remarks)
    del turning["yaw_rad"]
    blind = found(turning)
    demand_truth(blind, TRUTH)
    assert blind.motion is None
    assert any("no yaw: taken as 0" in remark for remark in blind.remarks)


def test_positions_serve_where_velocities_are_missing() -> None:
    """They are differentiated."""
    log = fly(TRUTH, Flown(), 1)[0]
    del log["vx_m_s"], log["vy_m_s"]
    motion = motion_of(log)
    assert abs(motion.acceleration_per_tilt.value - TRUTH.acceleration_per_tilt) < 0.05


def second_order_log(frequency_rad_s: float, damping: float, flown: Flown) -> dict[str, Array]:
    """Return time, tilt, yaw and commands of a drone of second order with a gain of 0.92."""
    log = dict(fly(TRUTH, flown, 1)[0])
    drone = ([frequency_rad_s**2], [1.0, 2.0 * damping * frequency_rad_s, frequency_rad_s**2])
    ((top,), bottom, _) = cont2discrete(drone, 0.01)
    random = np.random.default_rng(1)
    for name in ("roll", "pitch"):
        noise = 0.002 * random.normal(size=len(log["time_s"]))
        log[f"{name}_rad"] = 0.92 * lfilter(top, bottom, log[f"{name}_command_rad"]) + noise
    return {name: log[name] for name in ("time_s", *NAMES[:5])}


@pytest.mark.parametrize(("frequency_rad_s", "damping"), [(15.0, 0.6), (12.0, 0.4)])
def test_a_response_of_second_order_has_no_integrator(frequency_rad_s: float, damping: float) -> None:
    """An integrator would fit it too, with a wrong gain; the interval of the gain holds the true one."""
    summary = found(second_order_log(frequency_rad_s, damping, Flown(duration_s=44.0)))
    for fit in fits(summary):
        assert fit.integral_1_s is None
        assert abs(fit.gain.value - 0.92) <= fit.gain.within < 0.06
    assert "integral" not in " ".join(summary.model)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("frequency_rad_s", "damping"), [(22.0, 0.75), (15.0, 0.6)])
@pytest.mark.parametrize("sines_rad", [0.05, 0.0175])
def test_slow_motion_decides_on_lag_and_gain(
    frequency_rad_s: float, damping: float, sines_rad: float
) -> None:
    """Of a drone of second order, whatever its sines; else the sum is up to 25 ms too large."""
    flown = Flown(duration_s=44.0, sines_rad=sines_rad)
    summary = found(second_order_log(frequency_rad_s, damping, flown))
    for axis in summary.axes.values():
        assert axis.verdict == "good"
        assert axis.first_order is not None
        gain, sum_s = axis.first_order.gain, axis.first_order.sum_s
        assert abs(gain.value - 0.92) < 0.01
        assert abs(sum_s.value - 2.0 * damping / frequency_rad_s) < min(sum_s.within, 0.006)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("drag_1_s", "rate_rad_s"), [(0.15, 1.2), (0.456, 1.5)])
def test_a_filtered_velocity_does_not_hide_the_drag(drag_1_s: float, rate_rad_s: float) -> None:
    """A lag of 30 ms is found, and the drag lies in its interval; without the lag it is 0.06 to 0.1 low."""
    truth = replace(TRUTH, drag_1_s=drag_1_s)
    for log in fly(truth, Flown(rate_rad_s=rate_rad_s), 5, 3):
        motion = motion_of(filter_velocity(log, 0.03))
        assert abs(motion.drag_1_s.value - drag_1_s) < min(motion.drag_1_s.within, 0.1)
        assert motion.drag_1_s.within < 0.2
        assert abs(motion.velocity_lag_s.value - 0.03) < motion.velocity_lag_s.within + 0.01


def test_a_drag_that_is_hardly_told_from_the_tilt_has_a_wide_interval() -> None:
    """With 3 1/s the velocity follows the tilt: the bias by gusts is six times what is left, and is held.

    With a drag of 0.33 the two differ, and the interval is narrow.
    """
    wide, narrow = (replace(TRUTH, lag_s=(0.147, 0.157), drag_1_s=drag_1_s) for drag_1_s in (3.0, 0.33))
    flown = Flown(duration_s=60.0, size_m=1.5, rate_rad_s=0.8, slow_rad=0.002)
    for truth, least, most in ((wide, 0.6, 1.5), (narrow, 0.03, 0.1)):
        for log in fly(truth, flown, 4, 7):
            motion = motion_of(log)
            share, drag = motion.acceleration_per_tilt, motion.drag_1_s
            assert abs(drag.value - truth.drag_1_s) < drag.within
            assert abs(share.value - truth.acceleration_per_tilt) < share.within
            assert least < drag.within < most


@pytest.mark.long
def test_many_logs_do_not_remove_the_bias_of_gusts() -> None:
    """A controller tilts against gusts: the interval of acceleration per tilt holds what that hides."""
    motion = motion_of(*fly(TRUTH, Flown(size_m=0.5, gusts_m_s2=0.2), 6, 7))
    share = motion.acceleration_per_tilt
    left = (1.0 - motion.r2) * share.value
    assert share.within - left < abs(share.value - TRUTH.acceleration_per_tilt) < share.within


@pytest.mark.long
def test_several_logs_are_pooled() -> None:
    """Three logs have narrower intervals than the first of them; each may have an offset of its own."""
    logs = fly(TRUTH, Flown(duration_s=20.0), 3)
    logs[1]["roll_rad"] = logs[1]["roll_rad"] + 0.03
    one, three = found(logs[0]), found(*logs)
    demand_truth(three, TRUTH)
    assert three.duration_s == pytest.approx(60.0, abs=0.1)
    for alone, pooled in zip(fits(one), fits(three), strict=True):
        assert pooled.gain.within < 0.8 * alone.gain.within
        assert pooled.sum_s.within < alone.sum_s.within


def test_the_model_section_has_what_was_found() -> None:
    """Four digits of each, without a key for the integrator that was not worth it."""
    summary = found(fly(TRUTH, Flown(yaw_rate_rad_s=0.3), 1)[0])
    roll = fits(summary)[0]
    assert summary.model["roll_gain"] == float(f"{roll.gain.value:.4g}")
    assert summary.model["roll_delay_s"] == float(f"{roll.delay_s.value:.4g}")
    assert "roll_integral_1_s" not in summary.model
    assert {"pitch_lag_s", "pitch_trim_rad", "acceleration_per_tilt", "drag_1_s"} < summary.model.keys()


@pytest.mark.parametrize("turn_rad_s", [0.12, -0.12])
def test_a_trim_is_told_from_the_wind_where_the_heading_turns(turn_rad_s: float) -> None:
    """A wind as strong as a tilt of 3 degrees moves the trims by less than half a degree."""
    flown = Flown(yaw_rate_rad_s=turn_rad_s, push_m_s2=(0.5, -0.3))
    summary = found(fly(TRUTH, flown, 1)[0])
    assert summary.motion is not None
    for trim, truth in zip(summary.motion.trim_rad, TRUTH.trim_rad, strict=True):
        assert abs(trim.value - truth) < min(trim.within, 0.008)
    assert "roll_trim_rad = " in vehicle_text(summary, 1.0)


@pytest.mark.parametrize("turn_rad_s", [0.0, 0.05])
def test_a_trim_is_not_known_where_the_heading_hardly_turns(turn_rad_s: float) -> None:
    """No file has one, and the table says why: the controller learns it, or the wind, in flight."""
    summary = found(fly(TRUTH, Flown(yaw_rate_rad_s=turn_rad_s, push_m_s2=(0.5, -0.3)), 1)[0])
    vehicle, rows = vehicle_text(summary, 1.0), dict(motion_rows(summary))
    assert "trim_rad = " not in vehicle + model_text(summary)
    assert "trim_rad are not known" in vehicle
    assert rows["trim of roll, pitch"] == "not known: turn the heading, both ways"
    assert vehicle_toml.parse(vehicle, "drone", "drone").attitude is not None


@pytest.mark.long
def test_stretches_without_flight_are_left_out() -> None:
    """A tumble, a gap and the time on the ground, each with garbage in it."""
    log = dict(fly(TRUTH, Flown(duration_s=45.0), 1)[0])
    log = {name: values.copy() for name, values in log.items()}
    height = np.full(len(log["time_s"]), -1.0)
    log["roll_rad"][1500:1510] = 2.0
    log["pitch_rad"][1500:1510] = -3.0
    height[:500] = 0.0
    log["roll_rad"][:500] = 0.3 * np.sin(np.arange(500.0))
    log["z_m"] = height
    kept = np.ones(len(height), np.bool_)
    kept[3000:3060] = False
    summary = found({name: values[kept] for name, values in log.items()})
    demand_truth(summary, TRUTH)
    assert 34.0 < summary.duration_s < 38.0


def test_a_clock_that_jumps_is_a_gap() -> None:
    """By a second, or by fifty years, as when a clock is set in flight."""
    log = fly(TRUTH, Flown(duration_s=40.0), 1)[0]
    late = log["time_s"] + np.where(np.arange(4000) < 2000, 0.0, 1.7e9)
    summary = found(log | {"time_s": late})
    demand_truth(summary, TRUTH)
    assert summary.duration_s == pytest.approx(40.0, abs=0.1)


def test_an_outage_of_the_position_is_cut_out() -> None:
    """A second without velocity, and a velocity that is too rare to be used."""
    columns = fly(TRUTH, Flown(), 1)[0]
    log = log_of(columns)
    kept = np.abs(columns["time_s"] - 15.0) > 0.5
    signals = dict(log.signals)
    for name in ("vx_m_s", "vy_m_s"):
        signal = signals[name]
        signals[name] = replace(signal, time_s=signal.time_s[kept], value=signal.value[kept])
    summary = identify([replace(log, signals=signals)])[0]
    demand_truth(summary, TRUTH)
    assert summary.duration_s == pytest.approx(29.0, abs=0.1)
    assert summary.motion is not None
    assert abs(summary.motion.acceleration_per_tilt.value - TRUTH.acceleration_per_tilt) < 0.04


def demand_cover(estimates: list[Interval], truths: list[float], least: float) -> None:
    """Demand that a share of the intervals covers the truth, and that they are not wide without need."""
    inside = [abs(one.value - truth) <= one.within for one, truth in zip(estimates, truths, strict=True)]
    assert np.mean(inside) >= least
    errors = [abs(one.value - truth) for one, truth in zip(estimates, truths, strict=True)]
    assert np.mean([one.within for one in estimates]) < 12.0 * np.mean(errors)


@pytest.mark.sampled(5)
@pytest.mark.long
@pytest.mark.parametrize(
    ("truth", "flown"),
    [
        (TRUTH, Flown()),
        (TRUTH, Flown(size_m=0.5, gusts_m_s2=0.2)),
        (replace(TRUTH, lag_s=(0.14, 0.14), delay_s=(0.03, 0.03)), Flown(duration_s=20.0)),
    ],
)
def test_intervals_cover_the_truth_in_ninety_of_a_hundred(truth: Truth, flown: Flown) -> None:
    """Of gain, sum, lag and dead time of both axes, with lost rows and wrong times; and of the motion.

    Each of the three kinds of flight is flown `FLIGHTS` times.
    """
    random = np.random.default_rng(5)
    summaries = [found(drop_and_jitter(log, random)) for log in fly(truth, flown, FLIGHTS, 7)]
    fitted = [(axis, fit) for summary in summaries for axis, fit in enumerate(fits(summary))]
    gains, lags, delays = truth.gain, truth.lag_s, truth.delay_s
    demand_cover([fit.gain for _, fit in fitted], [gains[axis] for axis, _ in fitted], 0.9)
    demand_cover([fit.sum_s for _, fit in fitted], [lags[axis] + delays[axis] for axis, _ in fitted], 0.9)
    plain = [(axis, fit) for axis, fit in fitted if fit.integral_1_s is None]
    assert len(plain) >= 0.9 * 2 * FLIGHTS
    unknown = [(axis, fit) for axis, fit in plain if not fit.split_is_known]
    assert all(abs(fit.lag_s.value - lags[axis]) <= fit.lag_s.within for axis, fit in unknown)
    plain = [(axis, fit) for axis, fit in plain if fit.split_is_known]
    assert len(plain) >= 0.8 * 2 * FLIGHTS
    demand_cover([fit.lag_s for _, fit in plain], [lags[axis] for axis, _ in plain], 0.9)
    demand_cover([fit.delay_s for _, fit in plain], [delays[axis] for axis, _ in plain], 0.9)
    motions = [summary.motion for summary in summaries if summary.motion]
    assert len(motions) == FLIGHTS
    shares = [motion.acceleration_per_tilt for motion in motions]
    demand_cover(shares, [truth.acceleration_per_tilt] * FLIGHTS, 0.9)
    demand_cover([motion.drag_1_s for motion in motions], [truth.drag_1_s] * FLIGHTS, 0.9)
    trims = [trim for motion in motions for trim in motion.trim_rad]
    demand_cover(trims, [*truth.trim_rad] * FLIGHTS, 0.9)
