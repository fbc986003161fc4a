"""The Crazyflie's app as a target of `generate --for`."""

from typing import Final

from mambo_codegen.bundle.targets import FirmwareTarget

TARGET: Final = FirmwareTarget("crazyflie", "crazyflie", "src/", tick_s=0.001)
