"""Settings of a controller of roll and pitch alone, whose thrust a loop of its own commands."""

from mambo_codegen.settings.guard_section import Guard
from mambo_codegen.settings.model import Settings


def without_height(settings: Settings) -> Settings:
    """Return settings without [height], and without what a guard has for the thrust."""
    guard = settings.guard
    if guard is not None:
        thrust = {name: Guard.model_fields[name].default for name in ("thrust_m_s2", "thrust_m_s3")}
        guard = guard.model_copy(update=thrust)
    return Settings.model_validate(settings.model_copy(update={"height": None, "guard": guard}).model_dump())
