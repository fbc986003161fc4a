"""Constants of the guard: how much commands may vary, and what noise of target and position means."""

from dataclasses import dataclass

from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections


@dataclass(frozen=True)
class GuardConstants:
    """Constants of the guard, float64.

    tilt_rad, thrust_m_s2: what a budget holds: how much a command may vary at once.
    tilt_growth_rad, thrust_growth_m_s2: what a budget gains in a control step.
    """

    tilt_rad: float
    tilt_growth_rad: float
    thrust_m_s2: float
    thrust_growth_m_s2: float


def guard_constants(settings: Sections) -> GuardConstants | None:
    """Derive the constants of the guard; None without one."""
    guard, period_s = settings.guard, settings.horizon.update_period_s
    if guard is None:
        return None
    return GuardConstants(
        tilt_rad=guard.tilt_rad,
        tilt_growth_rad=guard.tilt_rad_s * period_s,
        thrust_m_s2=guard.thrust_m_s2,
        thrust_growth_m_s2=guard.thrust_m_s3 * period_s,
    )


def refusals(settings: Sections) -> list[Refusal]:
    """Return why a controller cannot have the guard of `settings`."""
    least_rad = 2 * settings.limits.tilt_rad
    if settings.guard is None or settings.guard.tilt_rad >= least_rad:
        return []
    return [Refusal("guard", "tilt_rad", f"must be at least {least_rad!r}, twice limits.tilt_rad")]
