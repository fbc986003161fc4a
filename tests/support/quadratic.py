"""The quadratic cost's law once more, in NumPy and SciPy: what the generator's constants are compared with.

Along one axis of the heading the state is [e, v, w, j, a, i, c, u], in SI units; i is the integral of u - a.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from tests.support.cases import limits_of
from tests.support.strategies import Values, nested

Array = NDArray[np.float64]

ANGLES: Final = ("roll", "pitch")
MAMBO_LOOPS: Final[Values] = {
    "model.roll_lag_s": 0.28,
    "model.pitch_lag_s": 0.1 / 0.65,
    "model.roll_delay_s": 0.045,
    "model.pitch_delay_s": 0.06,
    "model.roll_integral_1_s": 1.0,
    "model.pitch_integral_1_s": 0.5 / 0.65,
}
ONE_MOVE: Final[Values] = MAMBO_LOOPS | {
    "controller.method": "quadratic",
    "cost.response_time_s": 0.01 ** (1 / 3),
    "damping.roll_rate_feedback_s": 0.05,
    "model.start_attitude": "predicted",
}
"""One free move, for the Mambo."""
TWO_MOVES: Final[Values] = {
    "controller.method": "quadratic",
    "cost.response_time_s": 0.003 ** (1 / 3),
    "horizon.ramp_s": 0.4,
    "model.roll_lag_s": 0.1347,
    "model.pitch_lag_s": 0.1347,
    "model.roll_delay_s": 0.0235,
    "model.pitch_delay_s": 0.0235,
    "model.roll_integral_1_s": 0.4616,
    "model.pitch_integral_1_s": 0.4616,
    "limits.tilt_rad": 0.5,
    "observer.disturbance_noise": 3.0,
    "observer.position_noise": 0.001,
    "observer.velocity_noise": 0.15,
}
"""Two free moves, for the Crazyflie."""


def told(places_and_speeds: Any) -> Array:
    """Return targets (n, 9) of which positions and velocities (n, 4) are known and no more."""
    known = np.asarray(places_and_speeds, np.float64)
    return np.concatenate([known, np.zeros((len(known), 5))], axis=1)


def settings_of(values: Values) -> Settings:
    """Return the settings with `values` by their dotted paths."""
    return Settings.model_validate(nested(values))


@dataclass(frozen=True)
class Axis:
    """One axis: x+ = transition x + change (u+ - u), and the costs of e, v and of the change."""

    period_s: float
    integral_1_s: float
    ramp: int
    transition: Array
    change: Array
    state_cost: Array
    change_cost: float

    @property
    def decided(self) -> Array:
        """Whether the cost decides what a row takes of each state (8,): not of the jerk, 3."""
        decided: Array = (self.scale != 0) & (np.arange(8) != 3)
        return decided

    @property
    def scale(self) -> Array:
        """Factors from rows for SI units to those of the C, for steps: the integral part as acceleration."""
        period_s, share = self.period_s, self.integral_1_s
        return np.array([period_s**2, period_s, 1, 1 / period_s, 1, 1 / share if share else 0, 1, 1])

    def gain(self, to_go: Array) -> Array:
        """Return K (8,) of the best change -K x, if the state behind it costs x^T to_go x."""
        weighted = self.change @ to_go
        row: Array = (weighted @ self.transition) / (self.change_cost + (weighted @ self.change))
        return row


def attitude_model(settings: Settings, angle: str) -> tuple[Array, Array]:
    """Return how [a, i, c] goes on over a control step (3, 3), and what the command adds (3,)."""
    model, period_s = settings.model, settings.horizon.update_period_s
    lag_s = getattr(model, f"{angle}_lag_s") - getattr(settings.damping, f"{angle}_rate_feedback_s")
    delay_s, integral = (getattr(model, f"{angle}_{name}") for name in ("delay_s", "integral_1_s"))
    prompt = delay_s == 0
    follow = 1 / (period_s if prompt else delay_s)
    rates = np.array(
        [
            [-1 / lag_s, integral / lag_s, 0 if prompt else 1 / lag_s, 1 / lag_s if prompt else 0],
            [-1, -0.001, 0, 1],
            [0, 0, -follow, follow],
            [0, 0, 0, 0],
        ]
    )
    exact = expm(rates * period_s)
    return exact[:3, :3], exact[:3, 3]


def axis_of(settings: Settings, angle: str) -> Axis:
    """Return the model and the cost along the axis that `angle` tilts to."""
    model, period_s, cost = settings.model, settings.horizon.update_period_s, settings.cost
    lag_s = getattr(model, f"{angle}_lag_s") - getattr(settings.damping, f"{angle}_rate_feedback_s")
    delay_s, integral = (getattr(model, f"{angle}_{name}") for name in ("delay_s", "integral_1_s"))
    rates = np.zeros((8, 8))
    rates[0, 1] = rates[1, 2] = rates[1, 4] = 1
    rates[2, 2], rates[2, 3], rates[3, 3] = -0.001, -1, -1
    rates[4, 4], rates[4, 5], rates[4, 6 if delay_s else 7] = -1 / lag_s, integral / lag_s, 1 / lag_s
    rates[5, 4], rates[5, 5], rates[5, 7] = -1, -0.001, 1
    rates[6, 6], rates[6, 7] = -1 / (delay_s or period_s), 1 / (delay_s or period_s)
    transition = expm(rates * period_s)
    state_cost = np.zeros((8, 8))
    state_cost[0, 0], state_cost[1, 1] = 1, cost.velocity_weight_s**2
    return Axis(
        period_s=period_s,
        integral_1_s=integral,
        ramp=round(settings.horizon.ramp_s / period_s),
        transition=transition,
        change=transition[:, 7].copy(),
        state_cost=state_cost,
        change_cost=(cost.response_time_s**3 / period_s) ** 2,
    )


def long_horizon_gain(axis: Axis, steps: int) -> Array:
    """Return the gain of the first of `steps` moves without limits, by dynamic programming."""
    to_go = axis.state_cost
    for _ in range(steps):
        closed = axis.transition - np.outer(axis.change, gain := axis.gain(to_go))
        to_go = axis.state_cost + (closed.T @ to_go @ closed) + (axis.change_cost * np.outer(gain, gain))
    return axis.gain(to_go)


def two_move_cost(axis: Axis, steps: int) -> tuple[Array, Array]:
    """Simulate `steps` control steps; return H (2, 2) and G (2, 8) of the cost by [U1, U2].

    The cost is U^T H U / 2 + U^T G x plus what the moves do not change. The command is U1 behind one step, U2
    behind the ramp, and then without limits the best over a long horizon.
    """
    gain = long_horizon_gain(axis, steps)
    states = np.zeros((8, 10))
    states[:, :8] = np.eye(8)
    moves = np.eye(10)[8:]
    form = np.zeros((10, 10))
    for step in range(steps):
        if step == 0:
            change = moves[0] - states[7]
        elif step <= axis.ramp:
            change = (moves[1] - moves[0]) / axis.ramp
        else:
            change = -(gain @ states)
        form += (states.T @ axis.state_cost @ states) + (axis.change_cost * np.outer(change, change))
        states = (axis.transition @ states) + np.outer(axis.change, change)
    return 2 * form[8:, 8:], 2 * form[8:, :8]


def settling_steps(settings: Settings) -> int:
    """Return control steps after which a move no longer changes anything."""
    slowest_s = max(settings.cost.response_time_s, settings.cost.velocity_weight_s, 0.3)
    return round((settings.horizon.ramp_s + (40 * slowest_s)) / settings.horizon.update_period_s)


def closed_loop(axis: Axis, row: Any) -> Array:
    """Return the transition of [e, v, a, i, c, u] when u+ = row x, for a row (8,) in SI units."""
    change = np.asarray(row, np.float64) - np.eye(8)[7]
    moved = [0, 1, 4, 5, 6, 7]
    found: Array = (axis.transition + np.outer(axis.change, change))[np.ix_(moved, moved)]
    return found


CORNER_SETTINGS: Final[tuple[Values, ...]] = (
    ONE_MOVE | {"model.start_attitude": "measured", "damping.roll_rate_feedback_s": 0.0},
    TWO_MOVES | {"observer.outage_s": 0.03},
    ONE_MOVE
    | {
        "horizon.ramp_s": 0.4,
        "model.drag_1_s": 0.067,
        "observer.measurement_age_s": 0.041,
        "model.roll_trim_rad": 0.02,
    },
    TWO_MOVES
    | {
        "limits.tilt_rad": 0.05,
        "observer.outage_s": 0.0,
        "model.pitch_trim_rad": -0.03,
    },
    TWO_MOVES
    | {
        "limits.speed_m_s": 1.5,
        "limits.fence.x_min_m": -1.5,
        "limits.fence.x_max_m": 2.0,
    },
    TWO_MOVES
    | {"observer.disturbance_limit_m_s2": 0.0, "ranges.position_m": 5.0, "ranges.velocity_m_s": 2.0},
    TWO_MOVES
    | {
        "damping.roll_rate_feedback_s": 0.02,
        "limits.speed_m_s": 1.5,
        "guard.tilt_budget_rad_s": 1.0,
        "guard.position_noise": 0.1,
    },
    TWO_MOVES
    | {
        "limits.speed_m_s": 1.5,
        "model.drag_1_s": 0.2,
        "observer.outage_s": 0.03,
        "guard.tilt_budget_rad_s": 8.0,
    },
)
"""One move and two, attitude measured and predicted, with feedback, drag, age, trim and guard."""


def quadratic_case(index: int, scalar: str) -> Settings:
    """Make the valid settings number `index`: the corners first, then random ones of a seed."""
    return settings_of(case_values(index) | {"code.scalar": scalar})


def case_values(index: int) -> Values:
    """Return the values of the settings number `index` by their dotted paths."""
    if index < len(CORNER_SETTINGS):
        return CORNER_SETTINGS[index]
    rng = np.random.default_rng(index)

    def some(low: float, high: float) -> float:
        return float(rng.choice([0.0, 10.0 ** rng.uniform(np.log10(low), np.log10(high))]))

    period_s = float(rng.choice([0.001, 0.0025, 0.01, 0.01, 0.02, 0.1]))
    tilt_rad = float(rng.choice([0.05, 0.35, 0.5, 1.2]))
    values: Values = {
        "horizon.update_period_s": period_s,
        "horizon.ramp_s": float(rng.choice([0.0, max(0.02, 2 * period_s), 0.4, 1.0])),
        "limits.tilt_rad": tilt_rad,
        "model.start_attitude": str(rng.choice(["measured", "predicted"])),
        "model.acceleration_per_tilt": float(rng.uniform(0.5, 1.5)),
        "model.drag_1_s": some(0.01, 5),
        "controller.method": "quadratic",
        "cost.response_time_s": float(10.0 ** rng.uniform(-1.5, 0.2)),
        "cost.velocity_weight_s": some(0.01, 2),
        "observer.disturbance_limit_m_s2": float(rng.choice([0.0, 3.0, 20.0])),
        "observer.measurement_age_s": some(0.001, 0.2),
        "observer.outage_s": float(rng.integers(0, 40)) * period_s if period_s < 0.05 else 0.3,
        "ranges.position_m": float(rng.choice([5.0, 1000.0, 10000.0])),
        "ranges.velocity_m_s": float(rng.choice([2.0, 100.0])),
    }
    noises = ("acceleration_noise", "disturbance_noise", "position_noise", "velocity_noise")
    values |= {f"observer.{name}": float(10.0 ** rng.uniform(-3, 1)) for name in noises}
    for angle in ANGLES:
        gain, feedback_s = float(rng.uniform(0.5, 1.5)), some(0.001, 0.2)
        values |= {
            f"damping.{angle}_rate_feedback_s": feedback_s,
            f"model.{angle}_lag_s": feedback_s + float(10.0 ** rng.uniform(-2.9, 0.2)),
            f"model.{angle}_delay_s": some(0.001, 0.3),
            f"model.{angle}_integral_1_s": some(0.01, 20),
            f"model.{angle}_gain": gain,
            f"model.{angle}_trim_rad": float(rng.choice([0.0, 1.0]))
            * min(0.2, 0.9 * gain * tilt_rad)
            * rng.uniform(-1, 1),
        }
    tilted_rad = min(
        values[f"model.{a}_gain"] * tilt_rad - abs(values[f"model.{a}_trim_rad"]) for a in ANGLES
    )
    can_brake = 0.8 * 9.81 * values["model.acceleration_per_tilt"] * tilted_rad > 0.1
    if rng.random() < 0.5 and can_brake:
        ranges = {name: values[f"ranges.{name}"] for name in ("position_m", "velocity_m_s")}
        drawn = limits_of(rng, 0.05 * tilt_rad, ranges)
        fence = {f"limits.fence.{name}": wall for name, wall in drawn.pop("fence").items()}
        values |= fence | {f"limits.{name}": value for name, value in drawn.items()}
    return values | _guard_of(index, tilt_rad)


def _guard_of(index: int, tilt_rad: float) -> Values:
    """Draw a guard, or none, in every other case; most spend their budget in a few steps."""
    rng = np.random.default_rng([index, 1])
    if index % 2:
        return {}
    return {
        "guard.tilt_budget_rad": min(10.0, tilt_rad * float(rng.uniform(2, 4))),
        "guard.tilt_budget_rad_s": float(10.0 ** rng.uniform(-1, 2)),
        "guard.position_noise": float(10.0 ** rng.uniform(-3, 1)),
    }


def quadratic_settings(scalar: str = "float32", **horizon: Any) -> Settings:
    """Return preset mambo of a scalar type, with other values of the horizon's keys."""
    document = presets.preset("mambo").model_dump()
    changed = {"code": document["code"] | {"scalar": scalar}, "horizon": document["horizon"] | horizon}
    return Settings.model_validate(document | changed)


EVERYTHING = settings_of(
    ONE_MOVE
    | {
        "horizon.ramp_s": 0.4,
        "model.drag_1_s": 0.067,
        "model.roll_trim_rad": 0.02,
        "model.pitch_trim_rad": -0.01,
        "model.roll_gain": 0.9,
        "model.pitch_gain": 1.1,
        "damping.pitch_rate_feedback_s": 0.02,
        "observer.measurement_age_s": 0.013,
        "observer.outage_s": 0.05,
        "limits.tilt_rad": 0.25,
    }
)
"""Settings with every part of the method: two moves, trims, drag, age and feedback."""
