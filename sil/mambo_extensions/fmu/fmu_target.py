"""The mock-up unit as a target of `generate --for`."""

from typing import Final

from mambo_codegen.bundle.targets import NO_FLAGS, FirmwareTarget
from mambo_codegen.settings.model import Settings
from mambo_extensions.fmu.fmu_variables import fmu_variables


def _context(settings: Settings) -> dict[str, object]:
    return {"variables": fmu_variables(settings)}


TARGET: Final = FirmwareTarget(
    "fmu", "mambo", "sources/", opening=NO_FLAGS, self_test=False, context=_context
)
