"""Whose margins searched settings shall keep."""

from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.margins.margin_reserve import MarginReference, margins_of
from mambo_sil.model.derive.derived_flight import chosen_text


def margin_reference(source: str, settings: Settings, drone: VehicleFile) -> MarginReference:
    """Return the margins on a drone of a preset, or for other settings those of what `design` derives.

    source: what `settings` are from, a preset or a file. Settings with a 1-norm have none.
    Raises BuildError, CacheError.
    """
    if source in presets.names() or settings.controller.method == "1-norm":
        return margins_of(settings, drone, f"preset {source}" if source in presets.names() else source)
    derived = controller_toml.parse(chosen_text(drone, drone.name), drone.name)
    return margins_of(derived, drone, f"`design` for {drone.name}")
