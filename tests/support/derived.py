"""The settings that `design` derives from a drone."""

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.model.derive.derived_settings import EXACT_TILT_SHARES, controller_text


def settings_for(drone: VehicleFile, *, exact: bool = False) -> Settings:
    """Return the settings in the file that is written for a drone, with small angles or the exact tilt."""
    text = controller_text(drone, drone.name, exact_share=EXACT_TILT_SHARES[0] if exact else None)
    return controller_toml.parse(text, drone.name)
