"""Choose by a flight whether settings for a drone get the exact thrust vector."""

from mambo_codegen.errors import BuildError
from mambo_codegen.settings import controller_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.names import TargetAcceleration
from mambo_sil.model.derive.derived_flight import flies_quick_circle
from mambo_sil.model.derive.derived_settings import controller_text, wants_exact


def chosen_text(
    drone: VehicleFile,
    source: str,
    vehicle: str | None = None,
    acceleration: TargetAcceleration = "tracked",
) -> str:
    """Return the controller.toml that `design` writes: see `controller_text`.

    With the exact thrust vector if it is of use, and the drone survives a circle that is too quick for it.
    Small angles stay without a compiler.
    """
    if wants_exact(drone, acceleration):
        exact = controller_text(drone, source, vehicle, exact=True, acceleration=acceleration)
        try:
            if flies_quick_circle(controller_toml.parse(exact, source), drone):
                return exact
        except BuildError:
            pass
    return controller_text(drone, source, vehicle, acceleration=acceleration)
