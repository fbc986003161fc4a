"""Flights of generated apps that `design` asks for, by the firmware that a drone has."""

from collections.abc import Callable

from mambo_codegen import extensions
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.flown_settings import FlownSettings

AppFlight = Callable[[Settings, VehicleFile], FlownSettings]
"""Fly the app of settings on a drone; raises BuildError, CacheError, FlightError."""


def app_flight_of(drone: VehicleFile) -> AppFlight | None:
    """Return the flight of an app for the firmware of a drone; None if no extension flies one."""
    if drone.firmware is None or drone.firmware not in extensions.names("design"):
        return None
    found: AppFlight = extensions.load("design", drone.firmware)
    return found
