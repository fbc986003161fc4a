"""Names of metrics for readers, from their keys."""

from typing import Final

SEEN: Final = "seen_"
"""Begins the key of a metric of the estimated flight, which is all that a controller knows of."""
AS_ESTIMATED: Final = "as estimated: error of the estimated position, which the controller knows"

_UNITS: Final = {
    "_m2_s2": "m^2 s^2",
    "_m2_s": "m^2 s",
    "_m_s2": "m s^2",
    "_m_s": "m s",
    "_rad_s": "rad s",
    "_rad": "rad",
    "_m": "m",
}
_WORDS: Final = {
    **{index: index.upper() for index in ("iae", "ise", "itse", "itae")},
    "max": "largest",
    "3d": "in space",
}
_NAMES: Final = {
    "past_wall_m": ("past the wall", "m"),
    "speed_excess": ("speed over the limit", "share"),
}


def named(key: str) -> tuple[str, str]:
    """Split the key of a metric, such as rms_error_m, into its name and its unit."""
    suffix = next((suffix for suffix in _UNITS if key.endswith(suffix)), "")
    own = key.removeprefix(SEEN)
    words = (_WORDS.get(word, word) for word in own.removesuffix(suffix).split("_"))
    name, unit = _NAMES.get(own, (" ".join(words), _UNITS.get(suffix, "")))
    return name + (" as estimated" if key.startswith(SEEN) else ""), unit


def titled(key: str) -> str:
    """Return name and unit of a metric for the head of a column, such as IAE, m s."""
    return ", ".join(filter(None, named(key)))
