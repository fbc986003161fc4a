"""Settings for parity: seeded random values, and the corners that random values miss."""

from typing import Any

import numpy as np
from pydantic import ValidationError

from mambo_codegen.settings.model import Settings

SCALARS = ("float32", "float64", "fixed")

CORNER_HORIZONS = ((1, 1, 5), (2, 2, 5), (10, 10, 5), (50, 1, 5), (50, 50, 2))
"""Np, Nc and iterations of the first settings that `settings_case` makes."""


def settings_case(index: int, scalar: str) -> Settings:
    """Make the valid settings number `index`: the corners of the horizon first, then random ones.

    Weights too far apart for fixed point are drawn again.
    """
    rng = np.random.default_rng(index)
    while True:
        try:
            return _drawn_settings(index, scalar, rng)
        except ValidationError:
            if scalar != "fixed":
                raise


def _drawn_settings(index: int, scalar: str, rng: np.random.Generator) -> Settings:
    if index < len(CORNER_HORIZONS):
        return _random_settings(rng, scalar, *CORNER_HORIZONS[index])
    prediction = int(rng.choice([1, 2, 3, 5, 10, 10, 15, 20, 30, 50]))
    control = min(prediction, int(rng.choice([1, 2, 2, 3, 6, 20], p=[0.2, 0.2, 0.2, 0.2, 0.15, 0.05])))
    return _random_settings(rng, scalar, prediction, control, int(rng.choice([1, 2, 5, 5, 10, 20])))


def _random_settings(
    rng: np.random.Generator, scalar: str, prediction: int, control: int, iterations: int
) -> Settings:
    lags = [float(10.0 ** rng.uniform(-3, 0.3)) for _ in range(2)]
    match rng.integers(4):
        case 0 | 1:
            lags = [0.0, 0.0]
        case 2:
            lags[int(rng.integers(2))] = 0.0
        case _:
            pass
    initial = float(10.0 ** rng.uniform(-3, -1))
    document: dict[str, dict[str, Any]] = {
        "horizon": {
            "prediction": prediction,
            "control": control,
            "prediction_step_s": float(10.0 ** rng.uniform(-3, -0.5)),
        },
        "model": {
            "position_update": "printed" if not any(lags) and rng.random() < 0.3 else "exact",
            "yaw_convention": str(rng.choice(["rotation", "printed"])),
            "roll_lag_s": lags[0],
            "pitch_lag_s": lags[1],
        },
        "cost": {
            "tracking_weight": float(10.0 ** rng.uniform(-2, 5)),
            "effort_weight": float(rng.choice([0.0, 1.0, 10.0 ** rng.uniform(-2, 5)])),
        },
        "optimizer": {
            "variant": str(rng.choice(["rprop+", "irprop-"])),
            "iterations": iterations,
            "tolerance": float(rng.choice([0.0, 0.05, 10.0, 1000.0])),
            "initial_step_rad": initial,
            "increase": float(rng.uniform(1, 2)),
            "decrease": float(rng.uniform(0.1, 1)),
            "step_max_rad": float(rng.uniform(initial, 1)),
            "step_min_rad": initial * float(10.0 ** rng.uniform(-3, 0)),
            "warm_start": str(rng.choice(["last_command", "plan"])),
        },
        "limits": {"tilt_rad": float(rng.choice([0.01, 0.1, 0.35, 1.2]))},
        "ranges": {
            "position_m": float(rng.choice([5.0, 1000.0, 10000.0])),
            "velocity_m_s": float(rng.choice([2.0, 100.0])),
            "thrust_acceleration_max_m_s2": float(rng.choice([20.0, 50.0])),
        },
        "code": {"scalar": scalar},
    }
    document["target"] = {"acceleration": str(rng.choice(["none", "tracked"]))}
    document["damping"] = {"roll_rate_feedback_s": float(rng.choice([0.0, 0.0, 0.0005, 0.02]))}
    if 0 < lags[0] < 0.001 + document["damping"]["roll_rate_feedback_s"]:
        document["damping"] = {}
    document["horizon"]["update_period_s"] = float(10.0 ** rng.uniform(-3, 0))
    if rng.random() < 0.5 and document["limits"]["tilt_rad"] > 0.013:
        document["limits"] |= limits_of(rng, document["limits"]["tilt_rad"], document["ranges"])
    return Settings.model_validate(document)


def limits_of(rng: np.random.Generator, tilt_rad: float, ranges: dict[str, Any]) -> dict[str, Any]:
    """Draw limits of speed, braking and place for [limits], of which one at least is given."""
    reach_m = min(ranges["position_m"], float(rng.choice([1.0, 3.0, 10000.0])))
    walls = np.sort(rng.uniform(-reach_m, reach_m, (2, 2)), axis=1) * rng.choice([0.0, 1.0], (2, 1))
    speed_m_s = min(ranges["velocity_m_s"], float(10.0 ** rng.uniform(-1, 1.5)))
    braking_m_s2 = float(rng.uniform(0.2, 0.99) * 9.81 * tilt_rad)
    return {
        "speed_m_s": float(rng.choice([0.0, speed_m_s])),
        "braking_m_s2": min(braking_m_s2, 10.0) if braking_m_s2 > 0.1 and rng.random() < 0.5 else 0.0,
        "fence": {
            f"{axis}_{end}_m": float(wall)
            for axis, pair in zip("xy", walls, strict=True)
            for end, wall in zip(("min", "max"), pair, strict=True)
        },
    }
