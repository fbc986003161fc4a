"""Settings of controllers of the height, for a Crazyflie."""

from typing import Any, Final

from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings

CRAZYFLIE_HEIGHT: Final = {
    "lag_s": 0.072,
    "delay_s": 0.005,
    "thrust_min_m_s2": 2.9,
    "thrust_max_m_s2": 15.2,
}


def height_settings(scalar: str = "float32", **height: Any) -> Settings:
    """Return preset crazyflie with a height."""
    values: dict[str, Any] = presets.preset("crazyflie").model_dump(exclude_none=True)
    values["height"] = CRAZYFLIE_HEIGHT | height
    values["code"]["scalar"] = scalar
    return Settings.model_validate(values)
