"""The command `vehicles`: the drones that are shipped, and the schema of vehicle.toml."""

import json
from typing import Annotated

import typer

from mambo_sil.cli.options import AsJson, complete_vehicles


def vehicles(
    name: Annotated[
        str | None,
        typer.Argument(help="Shipped drone whose vehicle.toml to print.", autocompletion=complete_vehicles),
    ] = None,
    *,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of vehicle.toml, for editors.", metavar="")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """List the drones that can be flown, or print the file of one to start from."""
    from mambo_sil.drone.vehicles import VEHICLES
    from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

    if name is not None and (schema or as_json):
        raise typer.BadParameter("it prints a TOML file: leave out --schema and --json", param_hint=name)
    if schema:
        typer.echo(json.dumps(VehicleFile.json_schema(), indent=2))
        return
    if name is not None:
        typer.echo(VEHICLES.text(name), nl=False)
        return
    described = {each: VEHICLES.description(each) for each in VEHICLES.names()}
    if as_json:
        typer.echo(json.dumps(described, indent=2))
        return
    width = max(map(len, described))
    for each, description in described.items():
        typer.echo(f"{each:<{width}}  {description}")
