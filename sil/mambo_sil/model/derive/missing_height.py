"""Say why derived settings have no height, and what that costs."""

from typing import Final

from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

MORE_MASS, LESS_THRUST = 0.2, 0.05
"""Shares by which a mass or a thrust differs from that in the file."""
FIX: Final = "write [thrust] with lag_s and gain into its file"


def missing_height(drone: VehicleFile) -> str:
    """Return why the settings for a drone without `[height]` have none, and how far it then sinks.

    Its altitude loop has no integral: a thrust that is missing is `altitude.p_n_m` times the sinking.
    """
    if drone.rotors is not None or drone.thrust is not None:
        most_m_s2 = drone.largest_thrust_n / drone.body.mass_kg
        return f"height: not in the settings, since the largest thrust, {most_m_s2:.3g} m/s^2, hardly climbs"
    cost = ""
    if gain_n_m := drone.altitude.p_n_m:
        heavy_mm, weak_mm = (1e3 * share * drone.weight_n / gain_n_m for share in (MORE_MASS, LESS_THRUST))
        cost = (
            f"; by its altitude loop the drone sinks by {heavy_mm:.0f} mm under {100.0 * MORE_MASS:g} % more "
            f"mass, by {weak_mm:.0f} mm with {100.0 * LESS_THRUST:g} % less thrust"
        )
    return f"height: not in the settings, since the thrust is not known{cost}: {FIX}"
