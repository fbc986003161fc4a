"""The command `identify`: a model of the drone from flight logs, or the manoeuvre that such a log needs."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, Results, show


def identify(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Logs of one drone: CSV, also trace.csv and that of the Crazyflie's client, or ULog.",
            metavar="LOG...",
        ),
    ] = None,
    *,
    output: Results = Path("identified"),
    columns: Annotated[
        str,
        typer.Option(
            help="Columns of the CSV files by signal, with sign and factor if needed.",
            metavar="SIGNAL=COLUMN,...",
        ),
    ] = "",
    manoeuvre: Annotated[
        Path | None,
        typer.Option(
            help="Instead, write what to fly for a log: waypoints (.csv) or a Crazyflie script (.py).",
            metavar="FILE",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Identify gain, lag and dead time of a drone from flight logs; exit 1 if they do not show them."""
    if manoeuvre is not None:
        if logs or columns:
            raise typer.BadParameter("is used without logs and without --columns", param_hint="--manoeuvre")
        from mambo_sil.model.identify.manoeuvre import write_manoeuvre

        typer.echo(write_manoeuvre(manoeuvre))
        return
    if not logs:
        raise typer.BadParameter("name a flight log, or --manoeuvre FILE", param_hint="LOG...")
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.model.identify.columns import parse_columns
    from mambo_sil.model.identify.curves import curves_csv
    from mambo_sil.model.identify.identify import identify as fit
    from mambo_sil.model.identify.identify import read_logs
    from mambo_sil.model.identify.identify_plots import draw_fit
    from mambo_sil.model.identify.identify_record import CURVES, MODEL, PICTURES, VEHICLE, IdentifySummary
    from mambo_sil.model.identify.identify_report import identify_text, model_text, vehicle_text
    from mambo_sil.results.folders import SUMMARY, new_results

    chosen = parse_columns(columns)
    with progress_bar("reading") as bar:
        read = read_logs(logs, chosen)
        bar.stage("fitting")
        summary, curves = fit(read)
        bar.stage("drawing")
        with new_results(output, IdentifySummary.command, (CURVES, *PICTURES, MODEL, VEHICLE)) as folder:
            (folder / CURVES).write_text(curves_csv(curves), "utf-8")
            draw_fit(folder / CURVES, summary.split_s, summary.verdicts, folder / "fit")
            if summary.good:
                (folder / MODEL).write_text(model_text(summary), "utf-8")
                (folder / VEHICLE).write_text(vehicle_text(summary), "utf-8")
            summary.write(folder)
    show(summary, identify_text(summary), as_json=as_json)
    models = (MODEL, VEHICLE) if summary.good else ()
    typer.echo(f"{echo(str(output))}: {', '.join((*models, CURVES, *PICTURES, SUMMARY))}", err=True)
    if not summary.good:
        raise typer.Exit(1)
