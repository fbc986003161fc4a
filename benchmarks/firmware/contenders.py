"""The controllers that fly: those of the firmware, and the generated app with two settings."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.firmware.build import build, link
from benchmarks.firmware.laboratory import ControllerNumber
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import TARGETS
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text

PRESET: Final = "crazyflie"
DESIGN: Final = "design"


@dataclass(frozen=True)
class FirmwareController:
    """A controller, and the firmware that it is in."""

    name: str
    number: ControllerNumber
    image: Path


def app_settings() -> dict[str, Settings]:
    """Return the settings of the app: the preset, and what `design crazyflie` derives."""
    derived = controller_text(vehicle_toml.load("crazyflie"), "crazyflie")
    return {PRESET: presets.preset("crazyflie"), DESIGN: parse(derived, "design crazyflie")}


def contenders(firmware: Path) -> list[FirmwareController]:
    """Return all controllers, the app's first; raises as `build`."""
    libraries = {name: build(firmware, settings) for name, settings in app_settings().items()}
    others = [number for number in ControllerNumber if number is not ControllerNumber.APP]
    return [
        *(FirmwareController(name, ControllerNumber.APP, library) for name, library in libraries.items()),
        *(FirmwareController(number.name.lower(), number, libraries[PRESET]) for number in others),
    ]


_DATED: Final = "    date_estimate(state, now);\n"
_PREDICTED: Final = (
    "    shift_s = 0.0f;\n    if (last_prediction == now) {\n        next_update = now;\n    }\n"
)
_CLOCKS: Final = {
    "position dated, as generated": _DATED,
    "a step in the tick after a prediction": _DATED + _PREDICTED,
    "neither": "",
}
"""What stands where the app dates the estimated position."""


def clocks(firmware: Path) -> list[FirmwareController]:
    """Return the app with the preset, as generated and with other ways to meet the estimator's clock."""
    app = render_target(app_settings()[PRESET], TARGETS["crazyflie"], with_digest=False)
    source = app["src/nmpc_app.c"]
    if source.count(_DATED) != 1:
        message = f"the app has {source.count(_DATED)} lines {_DATED.strip()}"
        raise ValueError(message)
    return [
        FirmwareController(
            name,
            ControllerNumber.APP,
            link(firmware, {**app, "src/nmpc_app.c": source.replace(_DATED, line)}),
        )
        for name, line in _CLOCKS.items()
    ]
