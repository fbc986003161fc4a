"""The command `design`: settings derived from a vehicle."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.command import OutputFile, Overwrite, write_file
from mambo_sil.cli.options import VEHICLE_NAMES, complete_vehicles


def design(
    vehicle: Annotated[
        str,
        typer.Argument(
            help=f"The drone: {', '.join(VEHICLE_NAMES)}, or a vehicle.toml, also that of `identify`.",
            metavar="NAME|FILE",
            autocompletion=complete_vehicles,
        ),
    ],
    output: OutputFile = Path("controller.toml"),
    force: Overwrite = False,
) -> None:
    """Derive settings from a drone; write a controller.toml that says the reason of each."""
    from mambo_codegen.settings import controller_toml
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.model.derive.derived_settings import controller_text

    source = echo(vehicle)
    text = controller_text(vehicle_toml.load(vehicle), source)
    controller_toml.parse(text, f"settings for vehicle {source}")
    if write_file(text, output, force=force):
        name = echo(str(output))
        typer.echo(f"wrote {name}; next: mambo-nmpc fly {name} --vehicle {source}", err=True)
