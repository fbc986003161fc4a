"""What the fit of the thrust finds in logs with a known truth, and what it refuses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.model.identify.identify_record import ThrustResult
from mambo_sil.model.identify.response import Interval
from mambo_sil.model.identify.segments import cut
from mambo_sil.model.identify.thrust import fit_thrust
from tests.support.command import run
from tests.support.logs import Array, G, Lifting, draw_lifting, lift, log_of

TRUTH = Lifting()
LOG = lift(TRUTH)


def found(*logs: dict[str, Array]) -> ThrustResult:
    """Fit the thrust of logs."""
    result = fit_thrust([segment for log in logs for segment in cut(log_of(log))])
    assert result is not None
    return result


def holds(interval: Interval | None, truth: float) -> bool:
    """Return whether an interval holds a value."""
    return interval is not None and abs(interval.value - truth) <= interval.within


@pytest.mark.parametrize(
    "truth", [TRUTH, replace(TRUTH, lag_s=0.03, battery_sag_1_s=0.002, hover_command=0.4)]
)
def test_steps_of_height_show_gain_lag_hover_command_and_sag(truth: Lifting) -> None:
    """Within their intervals, which are narrow; in any unit of the command."""
    result = found(lift(truth))
    assert result.verdict == "good", result.reasons
    assert holds(result.gain, truth.gain)
    assert holds(result.lag_s, truth.late_s)
    assert holds(result.battery_sag_1_s, truth.battery_sag_1_s)
    assert result.hover_command == pytest.approx(G / truth.gain, rel=0.01)
    assert result.gain is not None
    assert result.lag_s is not None
    assert result.gain.within < 0.03 * result.gain.value
    assert result.lag_s.within < 0.02
    assert result.weight_g == pytest.approx(1.0, abs=0.1)


def test_the_drag_of_the_climb_does_not_pass_for_a_lag() -> None:
    """Without it in the model the lag is 40 ms too short, and the slope 7 % too low; gusts aside."""
    truth = replace(TRUTH, lag_s=0.116, drag_1_s=0.5, gusts_m_s2=0.0)
    result = found(lift(truth))
    assert result.lag_s is not None
    assert result.lag_s.value == pytest.approx(truth.late_s, abs=0.005)
    assert result.drag_1_s == pytest.approx(truth.drag_1_s, abs=0.05)
    assert result.weight_g == pytest.approx(1.0, abs=0.01)
    assert result.hover_command == pytest.approx(truth.hover_command, rel=2e-3)


@pytest.mark.long
def test_drawn_drones_are_found() -> None:
    """Lag in its interval and gain within 1 % of at least 36 drones of 40."""
    random = np.random.default_rng(5)
    drones = [draw_lifting(random) for _ in range(40)]
    results = [found(lift(drone, seed)) for seed, drone in enumerate(drones)]
    both = list(zip(results, drones, strict=True))
    assert sum(result.verdict == "refused" for result in results) <= 2
    assert sum(holds(result.lag_s, drone.late_s) for result, drone in both) >= 36
    gains = [(result.gain, drone.gain) for result, drone in both]
    assert sum(gain is not None and abs(gain.value - truth) < 0.01 * truth for gain, truth in gains) >= 36
    assert sum(holds(gain, truth) for gain, truth in gains) >= 36
    assert sum(holds(result.battery_sag_1_s, drone.battery_sag_1_s) for result, drone in both) >= 36
    widths = [result.lag_s.within for result in results if result.lag_s is not None]
    assert np.median(widths) < 0.02


@pytest.mark.long
def test_an_estimator_that_errs_does_not_pass_for_a_lag() -> None:
    """The controller answers its errors; the lag then found is too long, its interval holds the truth."""
    truths = [
        replace(TRUTH, lag_s=0.04, step_m=step_m, error_m_s=error_m_s, duration_s=40.0)
        for error_m_s, step_m in ((0.1, 0.1), (0.15, 0.1), (0.15, 0.25))
    ]
    both = [(found(lift(truth, seed)), truth) for truth in truths for seed in (1, 2)]
    known = [(result.lag_s, truth.late_s) for result, truth in both if result.lag_s is not None]
    assert len(known) >= 4
    late_s, widths_s = np.array([(lag.value - truth, lag.within) for lag, truth in known]).T
    assert late_s.max() > 0.02
    assert (2.0 * np.abs(late_s) < widths_s).all()


@pytest.mark.parametrize("gusts_m_s2", [0.0, 0.03, 0.3])
def test_hover_alone_is_refused(gusts_m_s2: float) -> None:
    """It shows the command of hover and no lag; the message says so, and what to fly."""
    result = found(lift(replace(TRUTH, step_m=0.0, gusts_m_s2=gusts_m_s2)))
    assert result.verdict == "refused"
    assert "shows the command of hover, 3" in result.reasons[0]
    assert "fly steps of height" in result.reasons[0]
    assert (result.gain, result.lag_s, result.battery_sag_1_s) == (None, None, None)


def test_hover_with_a_noisy_height_is_told_to_fly_steps() -> None:
    """The noise changes the thrust, by 3 % and more, and moves nothing."""
    result = found(lift(replace(TRUTH, step_m=0.0, noise_m=0.01, gusts_m_s2=0.1)))
    assert result.verdict == "refused"
    assert "explains" in result.reasons[0]
    assert "fly steps of height" in result.reasons[0]


def test_a_refusal_does_not_advise_the_steps_that_were_flown() -> None:
    """The thrust of another flight: the message names the columns instead."""
    other = lift(replace(TRUTH, step_s=2.1), 2)
    result = found(LOG | {"thrust_command": other["thrust_command"]})
    assert result.verdict == "refused"
    assert "the columns are not the height and the thrust" in result.reasons[0]
    assert "fly" not in result.reasons[0]


def test_steps_that_were_too_gentle_are_not_advised_again() -> None:
    """Higher or quicker ones are."""
    result = found(lift(replace(TRUTH, lag_s=0.3)))
    assert result.verdict == "refused"
    assert "the height moved by 0." in result.reasons[0]
    assert "fly higher or quicker steps" in result.reasons[0]


def test_a_thrust_of_a_later_clock_is_refused() -> None:
    """It would have a lag below 0."""
    result = found(LOG | {"thrust_command": np.roll(LOG["thrust_command"], 12)})
    assert result.verdict == "refused"
    assert "clock" in result.reasons[0]


def test_a_thrust_that_is_not_sent_is_refused() -> None:
    """Or points down: its sign is wrong."""
    for factor in (0.0, -1.0):
        result = found(LOG | {"thrust_command": factor * LOG["thrust_command"]})
        assert result.reasons == ["the thrust that was sent is not positive: check its column and sign"]


def test_a_swing_that_is_too_slow_does_not_show_the_lag() -> None:
    """The interval of the lag says so, and what to fly is quicker."""
    slow = replace(
        TRUTH, step_m=0.1, step_s=5.0, level_s=44.0, duration_s=64.0, gusts_m_s2=0.06, noise_m=0.004
    )
    result = found(lift(slow))
    assert result.verdict != "good", result


@pytest.mark.parametrize("step_s", [1.2, 2.4])
def test_steps_in_time_with_the_windows_are_found(step_s: float) -> None:
    """Those that are fitted and those that are held out have some of them each."""
    result = found(lift(replace(TRUTH, step_s=step_s)))
    assert result.verdict == "good", result.reasons
    assert result.held_out_r2 > 0.9


def test_level_flight_before_the_steps_does_not_dilute_them() -> None:
    """What is judged is the liveliest part."""
    truth = replace(TRUTH, level_s=44.0, duration_s=64.0)
    result = found(lift(truth))
    assert result.verdict == "good", result.reasons
    assert holds(result.lag_s, truth.late_s)


def test_a_short_log_is_refused_and_several_are_pooled() -> None:
    """Each of 9 s is too short, both together are weak."""
    logs = [lift(replace(TRUTH, duration_s=9.0), seed) for seed in (1, 2)]
    alone, both = found(logs[0]), found(*logs)
    assert (alone.verdict, alone.reasons) == ("refused", ["6 s of flight; 8 s are needed"])
    assert (both.verdict, both.reasons) == ("weak", ["12 s of flight; 14 s are better"])
    assert holds(both.gain, TRUTH.gain)


def test_heights_in_another_unit_are_refused() -> None:
    """Centimetres would make the weight a hundredfold."""
    result = found(LOG | {"z_m": 100.0 * LOG["z_m"]})
    assert result.verdict == "refused"
    assert "check the units of height and time" in result.reasons[0]


def test_a_thrust_with_an_offset_is_weak_and_its_hover_command_right() -> None:
    """A command of which a part gives no thrust: the gain is larger than hover alone would say."""
    result = found(LOG | {"thrust_command": LOG["thrust_command"] + 10000.0})
    assert result.verdict == "weak"
    assert "not in proportion" in result.reasons[0]
    assert result.hover_command == pytest.approx(TRUTH.hover_command + 10000.0, rel=0.01)


def test_without_height_there_is_no_thrust() -> None:
    """Nor without a command."""
    for name in ("z_m", "thrust_command"):
        rest = {key: values for key, values in LOG.items() if key != name}
        assert fit_thrust(cut(log_of(rest))) is None


def test_the_thrust_of_a_vehicle_is_identified_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `fly` simulates is in vehicle.toml again, with its intervals."""
    monkeypatch.chdir(tmp_path)
    thrust = "[thrust]\ngain = 0.9\nlag_s = 0.08\n"
    Path("drone.toml").write_text(VEHICLES.text("generic") + thrust, "utf-8")
    eight = ("--trajectory", "swinging-eight", "--size-m", "1", "--rate-rad-s", "1.5")
    flags = ("--sensors", "mocap", "--duration-s", "20", "--no-pictures", "-o", "flown")
    run("fly", "--controller", "pd-feedforward", "--vehicle", "drone.toml", *eight, *flags)
    said, _ = run("identify", "flown/trace.csv", "-o", "found", "--mass-kg", "0.1")
    assert "thrust per command" in said
    drone = vehicle_toml.load("found/vehicle.toml")
    assert drone.thrust is not None
    assert drone.uncertainty is not None
    assert drone.uncertainty.thrust_gain is not None
    assert drone.uncertainty.thrust_lag_s is not None
    assert drone.thrust.gain == pytest.approx(0.9, abs=drone.uncertainty.thrust_gain)
    age_s = 0.01
    assert drone.thrust.lag_s == pytest.approx(0.08 + age_s, abs=drone.uncertainty.thrust_lag_s)
    assert drone.uncertainty.thrust_gain < 0.05
    assert np.isfinite(drone.thrust.lag_s)
