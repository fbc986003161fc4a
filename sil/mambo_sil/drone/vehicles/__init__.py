"""The drones that can be flown, each a vehicle.toml: body, rotors, loops and sensors as data."""

from typing import Final

from mambo_codegen.settings.toml_file import ShippedFiles

VEHICLES: Final = ShippedFiles(
    "vehicles",
    "a shipped vehicle",
    "vehicles",
    "`mambo-nmpc vehicles NAME` prints one to start from",
    __name__,
)
