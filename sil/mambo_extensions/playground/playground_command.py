"""`playground`: one HTML page in which controllers fly."""

from pathlib import Path
from typing import Annotated, Final

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.command import JoinedCommand
from mambo_sil.cli.options import AsJson, Drone, complete_presets, load_drone, output_option, show
from mambo_sil.cli.progress import progress_bar
from mambo_sil.results.terminal import sentence


def playground(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            help="At most four controllers: a preset, a controller.toml, the folder of a bundle, pd, "
            "pd-feedforward or pid-feedforward; by default mambo, mambo-1norm and both PDs.",
            metavar="[SOURCE]...",
            autocompletion=complete_presets,
        ),
    ] = None,
    *,
    output: Annotated[Path, output_option("HTML file; an earlier page there is overwritten.")] = Path(
        "play.html"
    ),
    vehicle: Drone = None,
    plan: Annotated[
        Path | None,
        typer.Option(help="File of `plan` that the target follows at first.", metavar="FILE"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write an HTML page, without network, in which the generated C flies a simulated drone in real time.

    To see how controllers fly before you read a figure.
    """
    from mambo_extensions.playground.page_controllers import DEFAULTS, page_controllers
    from mambo_extensions.playground.playground_page import PlaygroundSummary, playground_page
    from mambo_sil.flight.polynomials import PiecesInSpace
    from mambo_sil.results.html_page import new_page

    chosen = sources or DEFAULTS
    found, drone = page_controllers(chosen), load_drone(vehicle, *chosen)
    course = None if plan is None else PiecesInSpace.read(plan)
    if plan is not None and vehicle is None and sources is None:
        raise typer.BadParameter(
            "name the drone that the plan is for, with --vehicle, or its controller.toml", param_hint="--plan"
        )
    with new_page(output, "page") as write:
        with progress_bar("compiling") as bar:
            text, flown = playground_page(found, drone, bar, course)
        size = write(text)
    summary = PlaygroundSummary(page=str(output), bytes=size, vehicle=drone, controllers=flown)
    names = ", ".join(one.title for one in found)
    said = f"{echo(str(output))}: open it in a browser; {names} fly {echo(drone.name)}; {size / 1000:.0f} kB"
    show(summary, sentence(said), as_json=as_json)


COMMAND: Final = JoinedCommand(
    playground,
    panel="Start",
    after="doctor",
    examples="""\
mambo-nmpc playground -o play.html
mambo-nmpc playground pd controller.toml --vehicle crazyflie -o mine.html
""",
)
