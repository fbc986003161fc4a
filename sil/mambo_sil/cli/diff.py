"""The command `diff`: two controllers in control terms."""

from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.command import complete_presets
from mambo_sil.cli.options import AsJson, Drone, OptionalResults, show


def diff(
    a: Annotated[
        str,
        typer.Argument(
            help="A preset, a controller.toml, or the folder of a bundle.",
            metavar="A",
            autocompletion=complete_presets,
        ),
    ],
    b: Annotated[
        str,
        typer.Argument(help="What to compare it with.", metavar="B", autocompletion=complete_presets),
    ],
    *,
    output: OptionalResults = None,
    vehicle: Drone = "mambo",
    as_json: AsJson = False,
) -> None:
    """Compare two controllers: settings, gains, poles, flights; exit 0 if they are the same, 1 if not."""
    from mambo_codegen.settings import presets
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.experiment.compare.compare import compare
    from mambo_sil.experiment.compare.diff_record import PICTURES
    from mambo_sil.experiment.compare.diff_report import diff_text
    from mambo_sil.results.folders import SUMMARY

    sides = [(source, presets.load_or_bundle(source)) for source in (a, b)]
    with progress_bar("flying") as bar:
        summary = compare(sides[0], sides[1], vehicle_toml.load(vehicle), output, bar)
    show(summary, diff_text(summary), as_json=as_json)
    if output is not None:
        pictures = () if summary.same else PICTURES
        typer.echo(f"{echo(str(output))}: {', '.join((*pictures, SUMMARY))}", err=True)
    if not summary.same:
        raise typer.Exit(1)
