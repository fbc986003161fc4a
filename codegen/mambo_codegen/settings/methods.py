"""Which settings a controller with a 1-norm uses, and which one with a quadratic cost."""

from typing import Any, Final

from mambo_codegen.settings.sections import Sections

_ONE_NORM: Final = {
    "horizon": {"prediction", "control", "prediction_step_s"},
    "model": {"position_update", "yaw_convention", "thrust"},
    "cost": {"tracking_weight", "effort_weight"},
    "optimizer": {
        "variant",
        "iterations",
        "tolerance",
        "initial_step_rad",
        "increase",
        "decrease",
        "step_max_rad",
        "step_min_rad",
        "warm_start",
    },
}
_QUADRATIC: Final = {
    "horizon": {"ramp_s"},
    "model": {
        "roll_gain",
        "pitch_gain",
        "roll_delay_s",
        "pitch_delay_s",
        "roll_integral_1_s",
        "pitch_integral_1_s",
        "roll_trim_rad",
        "pitch_trim_rad",
        "acceleration_per_tilt",
        "drag_1_s",
        "attitude",
    },
    "cost": {"response_time_s", "velocity_weight_s"},
    "observer": {
        "acceleration_noise",
        "disturbance_noise",
        "position_noise",
        "velocity_noise",
        "disturbance_limit_m_s2",
        "age_s",
        "outage_s",
    },
}


def is_used(settings: Sections, section: str, name: str) -> bool:
    """Return whether a controller with the norm of `settings` uses a key."""
    others = _ONE_NORM if settings.cost.norm == "quadratic" else _QUADRATIC
    return name not in others.get(section, ())


def used_values(settings: Sections) -> dict[str, dict[str, Any]]:
    """Return the values of the keys that a controller uses, by section; a section without any is left out."""
    found = {
        section: {name: value for name, value in values.items() if is_used(settings, section, name)}
        for section, values in settings.model_dump().items()
    }
    return {section: values for section, values in found.items() if values}
