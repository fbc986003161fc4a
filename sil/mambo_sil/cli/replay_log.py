"""The command `replay`: the inputs in a flight log through the compiled controller."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, Results, Scalar, Source, load, show


def replay(
    log: Annotated[
        Path, typer.Argument(help="A log: trace.csv, CSV of a Crazyflie, or a .ulg of PX4.", metavar="LOG")
    ],
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    output: Results = Path("replayed"),
    columns: Annotated[
        str,
        typer.Option(
            help="Columns of the log by signal, with sign and factor if needed.",
            metavar="SIGNAL=COLUMN,...",
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Compare the commands in a log with those of the compiled controller; exit 1 if it is not what flew."""
    from mambo_sil.model.identify.columns import parse_columns
    from mambo_sil.model.replay.log_replay import SIGNALS, replay_log, write_curves
    from mambo_sil.model.replay.replay_plots import draw_replay
    from mambo_sil.model.replay.replay_report import (
        CURVES,
        PICTURES,
        LogReplaySummary,
        replay_text,
        summarise,
    )
    from mambo_sil.results.folders import SUMMARY, new_results

    settings = load(source, scalar)
    replayed = replay_log(log, parse_columns(columns, SIGNALS), settings)
    summary = summarise(replayed, str(log), source, settings.digest)
    with new_results(output, LogReplaySummary.command, (CURVES, *PICTURES)) as folder:
        write_curves(replayed, folder / CURVES)
        draw_replay(folder / CURVES, folder / "replay")
        summary.write(folder)
    show(summary, replay_text(summary), as_json=as_json)
    typer.echo(f"{echo(str(output))}: {', '.join((CURVES, *PICTURES, SUMMARY))}", err=True)
    if not summary.good:
        raise typer.Exit(1)
