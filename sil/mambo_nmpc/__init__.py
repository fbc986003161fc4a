"""Model predictive position control for small drones in static-memory C99.

    from mambo_nmpc import Controller, DroneState, TargetState, Vehicle, fly

runs generated C from Python (docs/reference/python.md); `mambo_nmpc.curves` has curves to fly.
`mambo_codegen` generates C from settings and `mambo_templates`; `mambo_sil` simulates flights with that C,
and tests it.
"""

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from mambo_codegen.errors import MamboNmpcError
    from mambo_extensions.mavlink.pilot import Pilot
    from mambo_extensions.plan.plans import Plan, plan
    from mambo_extensions.plan.points import PlanPoint
    from mambo_sil.api.api_controller import Controller
    from mambo_sil.api.campaigns import CampaignFlights, campaign, draw_vehicles
    from mambo_sil.api.flights import FlightResult, fly
    from mambo_sil.api.options import ControllerOptions
    from mambo_sil.drone.plant.vehicle import Vehicle
    from mambo_sil.errors import ArgumentError
    from mambo_sil.flight.frames import attitude_of_quaternion, command_in_frame
    from mambo_sil.flight.states import DroneState, StepOutcome, TargetState

    __all__ = [
        "ArgumentError",
        "CampaignFlights",
        "Controller",
        "ControllerOptions",
        "DroneState",
        "FlightResult",
        "MamboNmpcError",
        "Pilot",
        "Plan",
        "PlanPoint",
        "StepOutcome",
        "TargetState",
        "Vehicle",
        "attitude_of_quaternion",
        "campaign",
        "command_in_frame",
        "draw_vehicles",
        "fly",
        "plan",
    ]

_HOMES: Final = {
    "ArgumentError": "mambo_sil.errors",
    "CampaignFlights": "mambo_sil.api.campaigns",
    "Controller": "mambo_sil.api.api_controller",
    "ControllerOptions": "mambo_sil.api.options",
    "DroneState": "mambo_sil.flight.states",
    "FlightResult": "mambo_sil.api.flights",
    "MamboNmpcError": "mambo_codegen.errors",
    "StepOutcome": "mambo_sil.flight.states",
    "TargetState": "mambo_sil.flight.states",
    "Vehicle": "mambo_sil.drone.plant.vehicle",
    "attitude_of_quaternion": "mambo_sil.flight.frames",
    "campaign": "mambo_sil.api.campaigns",
    "command_in_frame": "mambo_sil.flight.frames",
    "draw_vehicles": "mambo_sil.api.campaigns",
    "fly": "mambo_sil.api.flights",
}
"""The module of each name of the core: imported at its first use, so that the command line starts at once."""


if not TYPE_CHECKING:  # a checker would take every name for one of this module

    def __getattr__(name: str) -> Any:
        """Return one of `__all__`, of the core or of an extension."""
        if name in _HOMES:
            return getattr(importlib.import_module(_HOMES[name]), name)
        if name == "__all__":
            return sorted({*_HOMES, *_extensions().names("api")})
        if name.startswith("_") or name not in _extensions().names("api"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return _extensions().load("api", name)


def _extensions() -> Any:
    """Return the module that knows the names of extensions, when it is needed."""
    return importlib.import_module("mambo_codegen.extensions")


def __dir__() -> list[str]:
    """Return the names of the module, also those that are not imported yet."""
    return sorted({*globals(), *_HOMES, *_extensions().names("api")})
