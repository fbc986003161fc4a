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
"""What follows "is now" in a message, by the dotted path of before."""
