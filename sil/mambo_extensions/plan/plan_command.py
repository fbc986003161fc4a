"""`plan`: from points to a course that a drone flies."""

from pathlib import Path
from typing import Annotated, Final

import typer

from mambo_codegen.errors import echo
from mambo_extensions.plan import LEAST_RATE, MOST_DRONES
from mambo_sil.cli.command import JoinedCommand
from mambo_sil.cli.options import (
    AsJson,
    Drone,
    Overwrite,
    complete_presets,
    load_drone,
    output_option,
    require_free,
    show,
    write_file,
)
from mambo_sil.cli.progress import progress_bar


def plan(
    points: Annotated[
        Path,
        typer.Argument(
            help="A CSV file of points, or a mission of QGroundControl (.plan).", metavar="POINTS"
        ),
    ],
    *,
    vehicle: Drone = None,
    controller: Annotated[
        str | None,
        typer.Option(
            help="A preset or a controller.toml that flies the plan; by default the settings of `design`.",
            metavar="SOURCE",
            autocompletion=complete_presets,
        ),
    ] = None,
    output: Annotated[
        Path, output_option("File for the pieces; the picture has its name, and the ending .png.")
    ] = Path("lap.csv"),
    force: Overwrite = False,
    closed: Annotated[
        bool, typer.Option("--closed", help="Return to the first point, in a lap that repeats.")
    ] = False,
    rate: Annotated[
        float,
        typer.Option(help="Speed over that of the quickest plan.", min=LEAST_RATE, max=1.0, metavar="SHARE"),
    ] = 1.0,
    drones: Annotated[
        int,
        typer.Option(
            help="How many drones are drawn, and fly the plan too.", min=1, max=MOST_DRONES, metavar="N"
        ),
    ] = 20,
    as_json: AsJson = False,
) -> None:
    """Plan the quickest lap through points that a drone flies, and fly it; exit 1 if there is none.

    When you have way-points or gates, and a drone: its thrust, lag and dead time limit the plan.
    """
    from mambo_codegen.settings import presets
    from mambo_extensions.plan.plans import plan as make
    from mambo_sil.api.api_controller import Controller
    from mambo_sil.drone.plant.vehicle import Vehicle
    from mambo_sil.results.terminal import result_text

    drone = load_drone(vehicle, *([] if controller is None else [controller]))
    chosen = None if controller is None else Controller(presets.load(controller))
    pictures = () if str(output) == "-" else (output.with_suffix(".png"), output.with_suffix(".svg"))
    for path in (output, *pictures):
        require_free(path, force=force)
    with progress_bar("planning") as bar:

        def progress(stage: str, share: float) -> None:
            bar.stage(stage)
            bar(share)

        made = make(
            points, Vehicle.of(drone), chosen, closed=closed, rate=rate, drones=drones, progress=progress
        )
        if write_file(made.text, output, force=force):
            made.draw(output)
    if pictures:
        names = ", ".join(echo(str(path)) for path in (output, *pictures))
        typer.echo(f"wrote {names}", err=True)
    show(made.summary, result_text(made.summary.result()), as_json=as_json)
    if not made.summary.good:
        raise typer.Exit(1)


COMMAND: Final = JoinedCommand(
    plan,
    panel="Fly",
    after="fly",
    examples="""\
mambo-nmpc plan points.csv --vehicle crazyflie -o lap.csv
mambo-nmpc plan points.csv --vehicle crazyflie --closed --rate 0.9 -o slower.csv
mambo-nmpc plan mission.plan --vehicle my-drone.toml -o mission.csv
""",
)
