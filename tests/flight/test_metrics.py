"""Metrics of synthetic traces whose integrals are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.metrics import TRANSIENT_S, measure, saturated_share
from mambo_sil.flight.traces import Trace

FloatArray = NDArray[np.float64]


def trace_of(time_s: FloatArray, error_m: FloatArray, command_rad: FloatArray) -> Trace:
    """Return a trace of horizontal errors (k, n, 2) and commands (k, n, 2)."""
    shape = error_m.shape[:2]
    target = np.broadcast_to([7.0, -3.0, 0.0, 0.0], (*shape, 4)).copy()
    position_m = np.full((*shape, 3), -HOVER_HEIGHT_M)
    position_m[..., :2] = target[..., :2] - error_m
    return Trace(
        time_s=time_s,
        position_m=position_m,
        velocity_m_s=np.zeros((*shape, 3)),
        euler_rad=np.zeros((*shape, 3)),
        target=target,
        command_rad=command_rad,
        thrust_acceleration_m_s2=np.full(shape, 9.81),
        status=np.zeros(shape, dtype=np.int64),
    )


def constant_trace(time_s: FloatArray) -> Trace:
    """Return two flights: one with a constant error of 5 m and a constant command, one with neither."""
    error_m = np.zeros((len(time_s), 2, 2))
    error_m[:, 0] = [3.0, -4.0]
    command_rad = np.zeros((len(time_s), 2, 2))
    command_rad[:, 0] = [0.1, -0.2]
    return trace_of(time_s, error_m, command_rad)


def test_constant_error_and_command_have_the_integrals_of_a_constant() -> None:
    """IAE is e T, ISE e^2 T, ITSE e^2 T^2/2, ITAE e T^2/2, e the Euclidean norm; effort is 1-norm times T."""
    metrics = measure(constant_trace(np.linspace(0.0, 20.0, 2001)))
    np.testing.assert_allclose(metrics.table2[:, 0], [100.0, 500.0, 5000.0, 1000.0], rtol=1e-12)
    found = [metrics.rms_error_m, metrics.max_error_m, metrics.effort_rad_s, metrics.command_variation_rad]
    np.testing.assert_allclose(np.array(found)[:, 0], [5.0, 5.0, 6.0, 0.0], rtol=1e-12)
    assert not any(values[1] for values in vars(metrics).values())


def test_last_command_adds_no_effort() -> None:
    """A command is held from its sample to the next, so the last one is never applied."""
    command_rad = np.zeros((3, 1, 2))
    command_rad[:, 0, 0] = [0.1, -0.2, 7.0]
    trace = trace_of(np.array([0.0, 1.0, 2.0]), np.zeros((3, 1, 2)), command_rad)
    np.testing.assert_allclose(measure(trace).effort_rad_s, 0.3, rtol=1e-12)


def test_command_variation_is_the_mean_change_per_step() -> None:
    """A command that alternates by 0.1 rad in roll and 0.2 rad in pitch changes by 0.3 rad per step."""
    time_s = np.linspace(0.0, 1.0, 101)
    command_rad = np.zeros((101, 1, 2))
    command_rad[1::2, 0] = [0.1, -0.2]
    metrics = measure(trace_of(time_s, np.zeros((101, 1, 2)), command_rad))
    np.testing.assert_allclose(metrics.command_variation_rad, 0.3, rtol=1e-12)
    np.testing.assert_allclose(metrics.effort_rad_s, 0.15, rtol=1e-12)


def test_error_is_integrated_by_the_trapezoidal_rule() -> None:
    """An error proportional to time has the exact IAE, and the ITAE of the trapezoidal rule."""
    time_s = np.array([0.0, 1.0, 2.0, 3.0])
    error_m = np.zeros((4, 1, 2))
    error_m[:, 0, 1] = time_s
    metrics = measure(trace_of(time_s, error_m, np.zeros((4, 1, 2))))
    np.testing.assert_allclose(metrics.iae_m_s, 4.5)
    np.testing.assert_allclose(metrics.itae_m_s2, 0.5 + 2.5 + 6.5)
    np.testing.assert_allclose(metrics.max_error_m, 3.0)


def test_final_error_is_that_of_the_last_sample() -> None:
    """The largest error lies before it."""
    error_m = np.zeros((3, 1, 2))
    error_m[:, 0, 0] = [1.0, 5.0, -2.0]
    metrics = measure(trace_of(np.array([0.0, 1.0, 2.0]), error_m, np.zeros((3, 1, 2))))
    np.testing.assert_array_equal(metrics.final_error_m, 2.0)
    np.testing.assert_array_equal(metrics.max_error_m, 5.0)


def test_errors_of_the_height_and_in_space() -> None:
    """Horizontal metrics do not see the height; of 3 m and 4 m the distance in space is 5 m."""
    time_s = np.linspace(0.0, 2.0, 201)
    error_m = np.zeros((201, 2, 2))
    error_m[..., 0] = 3.0
    level = trace_of(time_s, error_m, np.zeros((201, 2, 2)))
    heights = np.broadcast_to([[2.0, 0.5], [HOVER_HEIGHT_M, 0.0]], (201, 2, 2))
    position_m = level.position_m.copy()
    position_m[:, 0, 2] = -6.0
    position_m[100, 0, 2] = 3.0
    trace = replace(level, target=np.concatenate([level.target, heights], axis=-1), position_m=position_m)
    metrics = measure(trace)
    assert metrics.rms_error_m.tolist() == measure(level).rms_error_m.tolist()
    np.testing.assert_allclose(metrics.max_height_error_m, [5.0, 0.0], rtol=1e-12)
    np.testing.assert_allclose(
        metrics.rms_height_error_m, [np.sqrt(16.0 + 0.01 * 9.0 / 2.0), 0.0], rtol=1e-12
    )
    np.testing.assert_allclose(metrics.rms_error_3d_m, [np.sqrt(25.0 + 0.01 * 9.0 / 2.0), 3.0], rtol=1e-12)
    np.testing.assert_allclose(metrics.max_error_3d_m, [np.sqrt(34.0), 3.0], rtol=1e-12)


def test_take_off_is_left_out() -> None:
    """Samples before t = 0 do not change any metric."""
    late = constant_trace(np.linspace(0.0, 20.0, 2001))
    early = constant_trace(0.01 * np.arange(-500.0, 2001.0))
    early.position_m[:500] = 1e3
    early.command_rad[:500] = 1.0
    for name, value in vars(measure(late)).items():
        np.testing.assert_allclose(getattr(measure(early), name), value, rtol=1e-10, atol=1e-12)


def test_start_transient_can_be_left_out() -> None:
    """From 10 s on only the rest of the flight counts; ITAE still weights with the time since t = 0."""
    trace = constant_trace(0.01 * np.arange(2001.0))
    trace.position_m[:900, 0] = 1e3
    metrics = measure(trace, TRANSIENT_S)
    assert TRANSIENT_S == 10.0
    np.testing.assert_allclose(metrics.iae_m_s[0], 50.0, rtol=1e-12)
    np.testing.assert_allclose(metrics.itae_m_s2[0], 5.0 * (20.0**2 - 10.0**2) / 2.0, rtol=1e-12)
    np.testing.assert_allclose(metrics.rms_error_m[0], 5.0, rtol=1e-12)
    np.testing.assert_allclose(metrics.effort_rad_s[0], 3.0, rtol=1e-12)


def test_diverged_flight_has_no_metrics() -> None:
    """The metrics of a lost flight are NaN; those of the flight beside it are not."""
    trace = constant_trace(np.linspace(0.0, 20.0, 2001))
    trace.position_m[1500:, 1] = np.nan
    trace.command_rad[1500:, 1] = np.nan
    for value in vars(measure(trace)).values():
        assert np.isfinite(value[0])
        assert np.isnan(value[1])


def test_flight_shorter_than_the_transient_is_refused() -> None:
    """Fewer than two samples after the start of the measurement raise `ValueError`; two are enough."""
    with pytest.raises(ValueError, match="start_s = 10 must lie before the end 8"):
        measure(constant_trace(np.linspace(0.0, 8.0, 801)), TRANSIENT_S)
    with pytest.raises(ValueError, match="start_s = 10 must lie before the end 10"):
        measure(constant_trace(np.linspace(0.0, 10.0, 101)), TRANSIENT_S)
    two = measure(constant_trace(np.array([0.0, 10.0, 10.5])), TRANSIENT_S)
    np.testing.assert_allclose(two.iae_m_s[0], 2.5, rtol=1e-12)


def test_a_flight_among_many_has_the_metrics_of_the_flight_alone() -> None:
    """The metrics are equal bit for bit: the order of the additions does not depend on the batch."""
    rng = np.random.default_rng(1)
    error_m, command_rad = rng.normal(size=(1001, 3, 2)), rng.normal(size=(1001, 3, 2))
    time_s = np.linspace(0.0, 10.0, 1001)
    together = measure(trace_of(time_s, error_m, command_rad))
    for flight in range(3):
        one = slice(flight, flight + 1)
        alone = measure(trace_of(time_s, error_m[:, one], command_rad[:, one]))
        for name, values in vars(together).items():
            np.testing.assert_array_equal(getattr(alone, name), values[one], err_msg=name)


def test_the_saturated_share_counts_commands_at_the_limit() -> None:
    """Roll or pitch, either way; a command just below the limit does not count."""
    command_rad = np.array([[0.35, 0.0], [0.0, -0.35], [0.349, -0.349], [0.0, 0.0]])
    shares = saturated_share(np.stack([command_rad, 0.5 * command_rad], axis=1), 0.35)
    assert shares.tolist() == [0.5, 0.0]
