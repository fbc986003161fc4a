"""Logs whose angles come every 30 to 100 ms, as PX4 logs by default: taken, with wider intervals."""

from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import LogError
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.response import AxisParameters, fit_response, intervals
from mambo_sil.model.identify.segments import HeldCommand, cut
from mambo_sil.model.identify.signals import FlightLog, Signal
from mambo_sil.results.terminal import result_text
from tests.support.logs import Array, Flown, Truth, fly, log_of, ulog, write_log

TRUTH = Truth()
FLIGHTS = 3
"""Flights of each drone."""


def rarely(columns: dict[str, Array], random: np.random.Generator) -> FlightLog:
    """Return a log of every 3rd to 10th row, commands and angles each of other rows, as PX4's logger does."""
    signals = {}
    for number, (name, signal) in enumerate(log_of(columns).signals.items()):
        if number in (0, 2, 4):
            every = random.uniform(3.2, 9.8)
            steps = np.clip(np.round(every * random.uniform(0.85, 1.2, len(signal.time_s))), 3, 10)
            rows = np.cumsum(steps).astype(int)
            rows = rows[rows < len(signal.time_s)]
        signals[name] = Signal(signal.time_s[rows], signal.value[rows], name)
    return FlightLog("rare", signals)


def found(log: FlightLog) -> list[AxisParameters]:
    """Return the fits of roll and pitch, without the search for another order."""
    segments, counted = cut(log), [segment.counted for segment in cut(log)]
    fits = [fit_response(segments, axis, counted, integrator=False) for axis in range(2)]
    return [intervals(fit, segments, axis, counted) for axis, fit in enumerate(fits)]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("seed", range(6))
def test_intervals_of_rare_logs_hold_the_truth(seed: int) -> None:
    """Of drawn drones, held for 10 ms: gain, lag, dead time and their sum, no wider than they must be."""
    random = np.random.default_rng(seed)
    lag_s, delay_s = random.uniform(0.04, 0.2, 2), random.integers(0, 16, 2) / 200.0
    truth = Truth(
        gain=(random.uniform(0.75, 1.1), random.uniform(0.75, 1.1)),
        lag_s=(lag_s[0], lag_s[1]),
        delay_s=(delay_s[0], delay_s[1]),
    )
    inside = []
    for columns in fly(truth, Flown(yaw_rad=random.uniform(-3.0, 3.0)), FLIGHTS, seed):
        for axis, fit in enumerate(found(rarely(columns, random))):
            known = [(fit.gain, truth.gain[axis]), (fit.sum_s, truth.lag_s[axis] + truth.delay_s[axis])]
            known += [(fit.lag_s, truth.lag_s[axis]), (fit.delay_s, truth.delay_s[axis])]
            inside += [abs(one.value - value) <= one.within for one, value in known]
            assert fit.sum_s.within < 0.06
            assert fit.gain.within < 0.1
    assert np.mean(inside) >= 0.95


@pytest.mark.parametrize("period_s", [0.04, 0.1])
def test_a_rare_command_moves_on_between_its_samples(period_s: float) -> None:
    """On a curve through them; by how much later it was if held instead is half its period."""
    time_s = np.append(period_s * np.arange(50.0), 1e9)
    command = HeldCommand.of(Signal(time_s, np.sin(3.0 * time_s), "slow"))
    assert command.unknown_s == pytest.approx(0.25 * period_s)
    asked_s = np.arange(0.5, 1.5, 0.01)
    np.testing.assert_allclose(command.means(asked_s), np.sin(3.0 * (asked_s - 0.005)), atol=2e-3)


def test_the_default_log_of_px4_is_taken_and_says_what_it_costs(tmp_path: Path) -> None:
    """A set-point every 50 ms: a remark names the period, its cost and the lines for a faster log."""
    path = tmp_path / "log.ulg"
    columns = fly(TRUTH, Flown(), 1)[0]
    path.write_bytes(ulog({name: values[::5] for name, values in columns.items()}, quaternion=True))
    logs, faults = read_logs([path], {})
    assert not faults
    summary = identify(logs)[0]
    said = " ".join(result_text(summary.result(tmp_path)).split())
    assert "vehicle_attitude_setpoint.roll has a sample every 0.05 s" in said
    assert "the intervals of lag and dead time are wider by 13 ms" in said
    for line in (
        *("vehicle_attitude_setpoint 10", "vehicle_attitude 10"),
        *("vehicle_local_position 10", "hover_thrust_estimate 100", "logger_topics.txt"),
    ):
        assert line in said
    assert "white noise of roll" not in said
    for axis, result in enumerate(summary.axes.values()):
        fit = result.fitted
        assert fit is not None
        assert abs(fit.sum_s.value - TRUTH.lag_s[axis] - TRUTH.delay_s[axis]) <= fit.sum_s.within
        assert 0.0125 < fit.sum_s.within < 0.04


def test_a_log_that_is_too_rare_is_refused_with_reason_and_fix(tmp_path: Path) -> None:
    """Beyond 0.12 s; as ULog and as CSV."""
    columns = fly(TRUTH, Flown(duration_s=10.0), 1)[0]
    rare = {name: values[::15] for name, values in columns.items()}
    log = tmp_path / "log.ulg"
    log.write_bytes(ulog(rare, quaternion=True))
    for path, fix in ((log, "logger_topics.txt"), (write_log(rare, tmp_path / "log.csv"), "log at")):
        with pytest.raises(LogError) as raised:
            read_logs([path], {})
        said = str(raised.value)
        assert "every 0.15 s" in said
        assert "0.0002..0.12 s, since nothing shows what happens in between" in said
        assert fix in said
