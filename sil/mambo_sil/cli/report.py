"""The command `report`: one HTML page of the results of other commands."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.command import output_option
from mambo_sil.cli.options import AsJson, show


def report(
    folders: Annotated[
        list[Path], typer.Argument(help="Result folders of other commands.", metavar="DIR...")
    ],
    *,
    output: Annotated[
        Path,
        output_option("HTML file; an earlier report there is overwritten."),
    ] = Path("report.html"),
    as_json: AsJson = False,
) -> None:
    """Collect results on one HTML page that needs no network and no other file."""
    from mambo_sil.pages.report.report_page import ReportSummary, report_page
    from mambo_sil.results.html_page import new_page

    with new_page(output, "report") as write:
        text, results = report_page(folders)
        size = write(text)
    summary = ReportSummary(page=str(output), bytes=size, results=results)
    show(summary, f"{echo(str(output))}: {size / 1000:.0f} kB", as_json=as_json)
