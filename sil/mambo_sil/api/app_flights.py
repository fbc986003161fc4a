"""Flights of generated apps that `design` asks for, by the firmware that a drone has."""

from collections.abc import Callable
from typing import Final

from mambo_codegen.settings.model import Settings
from mambo_extensions.crazyflie.desk.desk_trial import fly_trial
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FirmwareName
from mambo_sil.flight.flown_settings import FlownSettings

AppFlight = Callable[[Settings, VehicleFile], FlownSettings]
"""Fly the app of settings on a drone; raises BuildError, CacheError, FlightError."""

APP_FLIGHTS: Final[dict[FirmwareName, AppFlight]] = {"crazyflie": fly_trial}


def app_flight_of(drone: VehicleFile) -> AppFlight | None:
    """Return the flight of an app for the firmware of a drone; None for a drone without."""
    return None if drone.firmware is None else APP_FLIGHTS[drone.firmware]
