"""Names by which options and files choose what is flown; light to import."""

from typing import Final, Literal, get_args

LevelCurveName = Literal["bernoulli", "gerono", "lissajous", "circle", "hover", "step"]
SpaceCurveName = Literal["tilted-circle", "helix", "swinging-eight", "height-step", "take-off-and-landing"]
CurveName = Literal[LevelCurveName, SpaceCurveName]
Start = Literal["hover", "take-off"]
"""In the air, or on the ground 5 s before the trajectory begins."""
SensorsKind = Literal["true", "mocap", "flow-deck", "autopilot", "mambo"]
"""What measures: nothing, since the true state is known; motion capture; a flow deck; the estimator of PX4 or
ArduPilot; what the Mambo has."""
SensorsName = Literal[SensorsKind, "mambo-derotated"]
"""`mambo-derotated` subtracts the rotation of the camera from the optical flow."""
DEFAULT_SENSORS: Final[dict[SensorsKind, SensorsName]] = {
    "true": "true",
    "mocap": "mocap",
    "flow-deck": "flow-deck",
    "autopilot": "autopilot",
    "mambo": "mambo-derotated",
}
"""The sensors with which a drone flies by default, by the kind in its file."""
PdName = Literal["pd", "pd-feedforward", "pid-feedforward"]
"""The laws without a model: the stock PD of the paper, the PD with feed-forward of the target's velocity and
acceleration, and the PID with feed-forward, low-pass and feedback of the tilt."""
ControllerName = Literal["nmpc", PdName, "reference"]
"""The generated C, one of the laws without a model, or the reference in Python."""
AltitudeName = Literal["stock", "feedforward", "pid"]
"""The loop that holds the height: the vehicle's own, that with feed-forward of the target's climb and
acceleration and compensation of the tilt, or a PID with these."""
EngineName = Literal["c", "numpy"]
"""What computes a simulation; the bits are the same."""

STARTS: Final[tuple[Start, ...]] = get_args(Start)
SENSORS_KINDS: Final[tuple[SensorsKind, ...]] = get_args(SensorsKind)
SENSORS_NAMES: Final[tuple[SensorsName, ...]] = get_args(SensorsName)
ENGINE_NAMES: Final[tuple[EngineName, ...]] = get_args(EngineName)
CURVE_NAMES: Final[tuple[str, ...]] = get_args(CurveName)
CURVE_FORMS: Final = f"{', '.join(CURVE_NAMES)}, FILE.csv or FILE.py:CLASS"
"""How an option names a curve."""
ALTITUDE_NAMES: Final[tuple[AltitudeName, ...]] = get_args(AltitudeName)
IN_SPACE: Final[tuple[SpaceCurveName, ...]] = get_args(SpaceCurveName)
"""Curves with a height."""
_UNTIMED: Final = ("hover", "step", "height-step", "take-off-and-landing")
TIMED: Final = tuple(name for name in CURVE_NAMES if name not in _UNTIMED)
"""Curves with an angular rate."""
SIZED: Final = tuple(name for name in CURVE_NAMES if name != "hover")
"""Curves with a size."""
PD: Final = "PD"
PD_FEEDFORWARD: Final = "PD-feedforward"
PID_FEEDFORWARD: Final = "PID-feedforward"
PD_NAMES: Final[tuple[PdName, ...]] = get_args(PdName)
CONTROLLER_NAMES: Final[tuple[ControllerName, ...]] = get_args(ControllerName)
PD_TITLES: Final[dict[str, str]] = {
    "pd": PD,
    "pd-feedforward": PD_FEEDFORWARD,
    "pid-feedforward": PID_FEEDFORWARD,
}
"""What tables and pictures call the laws without a model, by name."""


def kind_of(name: SensorsName) -> SensorsKind:
    """Return the kind of the sensors called `name`, as a vehicle.toml has it."""
    return "mambo" if name == "mambo-derotated" else name


def flies_settings(controller: str) -> bool:
    """Return whether a controller by name has settings: the C, or the reference in Python."""
    return controller in ("nmpc", "reference")
