"""Keys of controller.toml that had another name in version 0.3: a file of before is told the new one."""

from typing import Final

RENAMED: Final = {
    "cost.norm": "controller.method",
    "model.attitude": "model.start_attitude",
    "observer.age_s": "observer.measurement_age_s",
    "height.learn": "height.learnt",
    "height.learn_limit": "height.learnt_gain_limit; of a learnt acceleration it is "
    "height.learnt_acceleration_limit_m_s2, 9.81 times the number",
    "guard.tilt_rad": "guard.tilt_budget_rad",
    "guard.tilt_rad_s": "guard.tilt_budget_rad_s",
    "guard.thrust_m_s2": "guard.thrust_budget_m_s2",
    "guard.thrust_m_s3": "guard.thrust_budget_m_s3",
}
"""The name of today by the dotted path of before."""

GONE: Final = {"guard.target_noise_m_s2": "each target says what it knows"}
"""Why a key has no successor."""

OF_BEFORE: Final = {key: f"is now {name}" for key, name in RENAMED.items()} | {
    key: f"is gone, leave it out: {why}" for key, why in GONE.items()
}
"""What a message says of a key of before."""
