"""The command `same-bits`: the digest of the same steps from every build at hand."""

import json
from dataclasses import asdict
from typing import Annotated

import typer

from mambo_nmpc.sil.cli.options import AsJson, Scalar, Source, load, load_boards


def same_bits(
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    board: Annotated[
        str, typer.Option("--boards", help="Boards, separated by commas, or all.", metavar="NAME,NAME")
    ] = "all",
    steps: Annotated[
        int | None,
        typer.Option(
            min=100,
            help="Frozen steps, a hundred at a time; those of the bundle's own digest if none are named.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run the same frozen steps in every build at hand; exit 1 unless all digests are one."""
    from mambo_nmpc.codegen.digest import TICKS, episode_count
    from mambo_nmpc.sil.cli.progress import progress_bar
    from mambo_nmpc.sil.footprint.same_bits import REFERENCE, BuildDigest, count_builds, run_everywhere

    settings = load(source, scalar)
    chosen = [one for name in board.split(",") for one in load_boards(name)]
    count = episode_count(settings) if steps is None else steps // TICKS
    found: list[BuildDigest] = []
    with progress_bar("comparing builds") as progress:
        for result in run_everywhere(settings, chosen, count):
            found.append(result)
            progress(len(found) / count_builds(chosen))
            if not as_json:
                what = result.reason if result.digest is None else result.digest
                typer.echo(f"{result.where:12}{result.compiler:26}{result.optimisation:5}{what}")
    total = count * TICKS
    reference = next(result.digest for result in found if result.where == REFERENCE)
    ran = [result for result in found if result.digest is not None]
    others = [result for result in ran if result.digest != reference]
    if as_json:
        document = {"steps": total, "same": not others, "builds": [asdict(one) for one in found]}
        typer.echo(json.dumps(document, indent=2))
    else:
        typer.echo(
            f"{len(ran) - len(others)} of {len(ran)} have the bits of the reference over {total} steps; "
            f"{len(found) - len(ran)} not run"
        )
    if others:
        raise typer.Exit(1)
