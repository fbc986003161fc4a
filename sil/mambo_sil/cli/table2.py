"""The command `table2`: fly the cases of Table II of the paper."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, Results, Scalar, load, show

if TYPE_CHECKING:
    pass

PICTURES = ("figure3.png", "figure3.svg")
SENSED_TABLE = "sensors.md"


def table2(
    *,
    output: Results = Path("table2"),
    sensors: Annotated[
        bool,
        typer.Option(
            "--sensors", help="Fly the Table II case with the Mambo's sensors and estimators instead."
        ),
    ] = False,
    scalar: Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Fly Table II of the paper with both PDs and the presets for the Mambo, and check the paper's claims."""
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.experiment.table2.table2 import (
        PRESETS,
        Table2Summary,
        fly_table2,
        judge_table2,
        table2_text,
    )
    from mambo_sil.experiment.table2.table2_plots import DRAWN, draw_figure3
    from mambo_sil.flight.names import PD_TITLES
    from mambo_sil.flight.traces import write_npz
    from mambo_sil.results.folders import new_results

    if sensors:
        _fly_with_sensors(output, scalar, as_json=as_json)
        return
    settings = {name: load(name, scalar) for name in PRESETS}
    files = {name: f"{name.lower()}.npz" for name in (*PD_TITLES.values(), *settings)}
    with new_results(output, Table2Summary.command, (*files.values(), *PICTURES)) as folder:
        with progress_bar("flying Table II") as progress:
            traces = fly_table2(settings, progress)
        for name, trace in traces.items():
            write_npz(trace, folder / files[name])
        draw_figure3({name: traces[name] for name in DRAWN}, folder / "figure3")
        summary = judge_table2(traces, scalar)
        summary.write(folder)
    show(summary, table2_text(summary), as_json=as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(PICTURES)} and the traces", err=True)


def _fly_with_sensors(output: Path, scalar: str | None, *, as_json: bool) -> None:
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.experiment.table2.sensed import PRESETS, SensedSummary, fly_sensed, text
    from mambo_sil.results.folders import new_results

    settings = {name: load(name, scalar) for name in PRESETS}
    with new_results(output, SensedSummary.command, (SENSED_TABLE,)) as folder:
        with progress_bar("flying Table II with sensors") as progress:
            summary = SensedSummary(scalar=scalar, rows=fly_sensed(settings, progress))
        table = text(summary.rows)
        (folder / SENSED_TABLE).write_text(table + "\n", "utf-8")
        summary.write(folder)
    show(summary, table, as_json=as_json)
    typer.echo(f"{echo(str(output))}: {SENSED_TABLE}", err=True)
