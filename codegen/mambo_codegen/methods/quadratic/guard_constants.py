"""Constants of the guard: how much commands may vary, and what noise of target and position means."""

from dataclasses import dataclass

from mambo_codegen.settings.sections import Sections


@dataclass(frozen=True)
class GuardConstants:
    """Constants of the guard, float64.

    tilt_budget_rad, thrust_budget_m_s2: what a budget holds: how much a command may vary at once; of the
        thrust over height.thrust_gain, as its commands are.
    tilt_growth_rad, thrust_growth_m_s2: what a budget gains in a control step.
    """

    tilt_budget_rad: float
    tilt_growth_rad: float
    thrust_budget_m_s2: float
    thrust_growth_m_s2: float


def guard_constants(settings: Sections) -> GuardConstants | None:
    """Derive the constants of the guard; None without one."""
    guard, period_s = settings.guard, settings.horizon.update_period_s
    if guard is None:
        return None
    gain = settings.height.thrust_gain if settings.height else 1.0
    return GuardConstants(
        tilt_budget_rad=max(guard.tilt_budget_rad, 2 * settings.limits.tilt_rad),
        tilt_growth_rad=guard.tilt_budget_rad_s * period_s,
        thrust_budget_m_s2=guard.thrust_budget_m_s2 / gain,
        thrust_growth_m_s2=guard.thrust_budget_m_s3 * period_s / gain,
    )
