"""The settings that `design` derives from a drone."""

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.names import TargetAcceleration
from mambo_sil.model.derive.derived_settings import controller_text


def settings_for(
    drone: VehicleFile, *, exact: bool = False, acceleration: TargetAcceleration = "tracked"
) -> Settings:
    """Return the settings in the file that is written for a drone."""
    text = controller_text(drone, drone.name, exact=exact, acceleration=acceleration)
    return controller_toml.parse(text, drone.name)
