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
from tests.support.logs import Array, G, Lifting, lift, log_of

TRUTH = Lifting()


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
    assert holds(result.gain, G / truth.hover_command)
    assert holds(result.lag_s, truth.lag_s + truth.delay_s)
    assert holds(result.battery_sag_1_s, truth.battery_sag_1_s)
    assert result.hover_command == pytest.approx(truth.hover_command, rel=0.01)
    assert result.gain is not None
    assert result.gain.within < 0.06 * result.gain.value
    assert result.battery_sag_1_s is not None
    assert result.battery_sag_1_s.within < 1e-3
    assert result.weight_g == pytest.approx(1.0, abs=0.03)


@pytest.mark.long
def test_the_intervals_hold_the_truth() -> None:
    """Of 40 flights at least 36, each of gain, lag and sag."""
    truth = replace(TRUTH, battery_sag_1_s=0.001)
    results = [found(lift(truth, seed)) for seed in range(40)]
    assert sum(holds(each.gain, G / truth.hover_command) for each in results) >= 36
    assert sum(holds(each.lag_s, truth.lag_s + truth.delay_s) for each in results) >= 36
    assert sum(holds(each.battery_sag_1_s, truth.battery_sag_1_s) for each in results) >= 36


@pytest.mark.parametrize("gusts_m_s2", [0.0, 0.03, 0.3])
def test_hover_alone_is_refused(gusts_m_s2: float) -> None:
    """Gain and weight are then one number; the message says so, and what to fly."""
    result = found(lift(replace(TRUTH, step_m=0.0, gusts_m_s2=gusts_m_s2)))
    assert result.verdict == "refused"
    assert "in hover gain and weight are one number; fly steps of height" in result.reasons[0]
    assert (result.gain, result.lag_s, result.battery_sag_1_s) == (None, None, None)


def test_a_short_log_is_refused_and_several_are_pooled() -> None:
    """Each of 9 s is too short, both together are weak."""
    logs = [lift(replace(TRUTH, duration_s=9.0), seed) for seed in (1, 2)]
    alone, both = found(logs[0]), found(*logs)
    assert (alone.verdict, alone.reasons) == ("refused", ["6 s of flight; 8 s are needed"])
    assert (both.verdict, both.reasons) == ("weak", ["12 s of flight; 14 s are better"])
    assert holds(both.gain, G / TRUTH.hover_command)


def test_heights_in_another_unit_are_refused() -> None:
    """Centimetres would make the weight a hundredfold."""
    log = lift(TRUTH)
    result = found(log | {"z_m": 100.0 * log["z_m"]})
    assert result.verdict == "refused"
    assert "check the units of height and time" in result.reasons[0]


def test_a_thrust_with_an_offset_is_weak_and_its_hover_command_right() -> None:
    """A command of which a part gives no thrust: the gain is larger than hover alone would say."""
    log = lift(TRUTH)
    result = found(log | {"thrust_command": log["thrust_command"] + 10000.0})
    assert result.verdict == "weak"
    assert "not in proportion" in result.reasons[0]
    assert result.hover_command == pytest.approx(TRUTH.hover_command + 10000.0, rel=0.01)


def test_without_height_there_is_no_thrust() -> None:
    """Nor without a command."""
    log = lift(TRUTH)
    for name in ("z_m", "thrust_command"):
        rest = {key: values for key, values in log.items() if key != name}
        assert fit_thrust(cut(log_of(rest))) is None


def test_the_thrust_of_a_vehicle_is_identified_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `fly` simulates is in vehicle.toml again, with its intervals."""
    monkeypatch.chdir(tmp_path)
    thrust = "[thrust]\ngain = 0.9\nlag_s = 0.08\n"
    Path("drone.toml").write_text(VEHICLES.text("generic") + thrust, "utf-8")
    eight = ("--trajectory", "swinging-eight", "--size-m", "1", "--rate-rad-s", "1.5")
    flags = ("--sensors", "mocap", "--duration-s", "20", "--no-pictures", "-o", "flown")
    run("fly", "--controller", "pd-feedforward", "--vehicle", "drone.toml", *eight, *flags)
    said, _ = run("identify", "flown/trace.csv", "-o", "found")
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
