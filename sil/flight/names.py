"""Names by which options and files choose what is flown; light to import."""

from typing import Final, Literal, get_args

CurveName = Literal["bernoulli", "gerono", "lissajous", "circle", "hover", "step"]
Start = Literal["hover", "take-off"]
"""In the air, or on the ground 5 s before the trajectory begins."""
SensorsName = Literal["none", "mambo", "mambo-derotated"]
"""`mambo-derotated` subtracts the rotation of the camera from the optical flow."""
ControllerName = Literal["nmpc", "pd", "reference"]
"""The generated C, the stock PD, or the reference in Python."""
EngineName = Literal["c", "numpy"]
"""What computes a simulation; the bits are the same."""

CURVE_NAMES: Final[tuple[str, ...]] = get_args(CurveName)
PD: Final = "PD"
"""What tables and pictures call the stock PD."""
