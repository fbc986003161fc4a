"""What a program changes of a controller's settings when it makes one: arguments, checked like the keys."""

from typing import Any, Final, TypedDict

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.arguments import of_shape, require, require_choice
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.names import AltitudeName


class ControllerOptions(TypedDict, total=False):
    """What differs from the settings; a missing one leaves them as they are."""

    measurement_age_s: float
    """Age of the measured position and velocity (`observer.measurement_age_s`): 0 for true states."""
    tilt_rad: float
    """Largest command (`limits.tilt_rad`); a smaller one without `braking_m_s2` lowers that by as much."""
    speed_m_s: float
    """Largest speed (`limits.speed_m_s`), 0 for none."""
    braking_m_s2: float
    """Deceleration with which the drone approaches a target or a wall (`limits.braking_m_s2`)."""
    fence_m: tuple[float, float, float, float]
    """Least and largest x, least and largest y (`[limits.fence]`), north and east."""
    floor_m: float
    """Least height (`limits.fence.floor_m`), with `[height]`; a ceiling belongs to it."""
    ceiling_m: float
    """Largest height (`limits.fence.ceiling_m`), with `[height]`; alone with a floor at 0."""
    climb_m_s: float
    """Largest speed upwards (`height.climb_m_s`), with `[height]`."""
    descent_m_s: float
    """Largest speed downwards (`height.descent_m_s`), with `[height]`."""
    update_period_s: float
    """Time from one step to the next (`horizon.update_period_s`), 1 / 120 in a world of 240 Hz, say; with
    `[height]` the delay of the thrust changes by half as much."""
    height: AltitudeName
    """The altitude loop that commands the thrust where the settings have no `[height]`: "stock",
    "feedforward" or "pid"."""


KEYS: Final = {
    "measurement_age_s": "observer.measurement_age_s",
    "tilt_rad": "limits.tilt_rad",
    "speed_m_s": "limits.speed_m_s",
    "braking_m_s2": "limits.braking_m_s2",
    "floor_m": "limits.fence.floor_m",
    "ceiling_m": "limits.fence.ceiling_m",
    "climb_m_s": "height.climb_m_s",
    "descent_m_s": "height.descent_m_s",
    "update_period_s": "horizon.update_period_s",
}
"""Keys of a controller.toml by the name of the argument."""
LONGEST_THRUST_DELAY_S: Final = 0.1
"""Bound of `height.delay_s`."""
WALLS: Final = tuple(f"limits.fence.{wall}" for wall in ("x_min_m", "x_max_m", "y_min_m", "y_max_m"))


def with_options(settings: Settings, options: ControllerOptions) -> Settings:
    """Return `settings` with the options, but for `height`.

    Raises ArgumentError for an unknown option, one that these settings do not use, and all broken rules.
    """
    values: dict[str, object] = {}
    for name, value in options.items():
        require_choice("option", name, tuple(ControllerOptions.__annotations__))
        if name == "fence_m":
            walls = of_shape("fence_m", value, (len(WALLS),)).tolist()
            values |= dict(zip(WALLS, walls, strict=True))
        elif name in KEYS:
            if (unmet := settings.unmet(KEYS[name])) is not None:
                raise ArgumentError(f"{name} = {value!r} has no use {unmet}")
            require(not isinstance(value, bool), name, value, "be no truth value")
            values[KEYS[name]] = value
    if not values:
        return settings
    if "tilt_rad" in options and "braking_m_s2" not in options:
        values[KEYS["braking_m_s2"]] = _braking(settings, options["tilt_rad"])
    if "update_period_s" in options and settings.height is not None:
        values["height.delay_s"] = _thrust_delay_s(settings, options["update_period_s"])
    document: dict[str, Any] = settings.model_dump()
    for key, value in values.items():
        document = controller_toml.with_value(document, key, value)
    try:
        return controller_toml.validate(document, "options")
    except InvalidSettingsError as error:
        raise ArgumentError(_in_arguments(str(error))) from None


def _braking(settings: Settings, tilt_rad: object) -> float:
    """Return the braking limit in m/s^2 that goes with a tilt limit: as much less as the tilt is."""
    limits = settings.limits
    if not isinstance(tilt_rad, int | float) or not 0.0 < tilt_rad < limits.tilt_rad:
        return limits.braking_m_s2
    return limits.braking_m_s2 * tilt_rad / limits.tilt_rad


def _thrust_delay_s(settings: Settings, period_s: object) -> float:
    """Return the delay of the thrust with another update period, half of which it holds."""
    assert settings.height is not None
    if not isinstance(period_s, int | float):
        return settings.height.delay_s  # the wrong period is reported
    longer_s = period_s - settings.horizon.update_period_s
    return min(max(settings.height.delay_s + longer_s / 2.0, 0.0), LONGEST_THRUST_DELAY_S)


def _in_arguments(text: str) -> str:
    """Return the text of broken rules with the names of the arguments in place of the keys."""
    for name, key in KEYS.items():
        text = text.replace(key, name)
    return text.replace("options: ", "").replace("limits.fence.", "fence_m: ")
