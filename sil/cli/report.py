"""The command `report`: one HTML page of the results of other commands."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_nmpc.codegen.command import output_option
from mambo_nmpc.codegen.errors import FileExistsRefusedError, UnwritableError, echo
from mambo_nmpc.sil.cli.options import AsJson, show

MARK = '<meta name="generator" content="mambo-nmpc">'
"""Marks a page as a report, which may be overwritten."""


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
    from mambo_nmpc.codegen.atomic import put
    from mambo_nmpc.sil.report.page import ReportSummary, report_page

    name = echo(str(output))
    try:
        if output.is_file() and MARK.encode() not in output.read_bytes()[:1000]:
            raise FileExistsRefusedError(
                f"{name}: exists and is no report of mambo-nmpc; name another file with -o"
            )
        text, results = report_page(folders)
        page = text.encode("utf-8", "replace")  # a folder's name may be invalid UTF-8
        put(output, page)
    except OSError as error:
        raise UnwritableError(f"{name}: cannot be written: {error.strerror or error}") from error
    summary = ReportSummary(page=str(output), bytes=len(page), results=results)
    show(summary, f"{name}: {len(page) / 1000:.0f} kB", as_json=as_json)
