"""The module of PX4 as a target of `generate --for`."""

from typing import Final

from mambo_codegen.bundle.targets import FirmwareTarget

TARGET: Final = FirmwareTarget("px4", None, "src/modules/mc_nmpc/", flies_height=True)
