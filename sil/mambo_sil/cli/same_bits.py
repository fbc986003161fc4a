"""The command `same-bits`: compare the self-test digest of all builds."""

import contextlib
import json
from dataclasses import asdict
from typing import Annotated

import typer

from mambo_sil.cli.options import BAUD, AsJson, Baud, PortName, Scalar, Source, load, load_boards


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
            help="Self-test steps, in hundreds; by default as many as the bundle's self-test digest covers.",
        ),
    ] = None,
    port: PortName = None,
    baud: Baud = BAUD,
    as_json: AsJson = False,
) -> None:
    """Run the self-test steps in every build, or on the board at a port; exit 1 if a digest differs."""
    from mambo_codegen.bundle.digest import TICKS, episode_count
    from mambo_codegen.methods import method_of
    from mambo_sil.board.footprint.build_digests import (
        REFERENCE,
        BuildDigest,
        count_builds,
        run_everywhere,
        run_on_board,
    )
    from mambo_sil.cli.progress import progress_bar

    settings = load(source, scalar)
    chosen = [one for name in board.split(",") for one in load_boards(name)]
    count = episode_count(method_of(settings)) if steps is None else steps // TICKS
    found: list[BuildDigest] = []
    with contextlib.ExitStack() as stack:
        progress = stack.enter_context(progress_bar("comparing builds"))
        if port is None:
            results = run_everywhere(settings, chosen, count)
        else:
            from mambo_sil.cli.port import connect

            results = run_on_board(
                settings, stack.enter_context(connect(port, baud, settings)), count, progress
            )
        for result in results:
            found.append(result)
            if port is None:
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
            f"{len(ran) - len(others)} of {len(ran)} builds have the digest of the reference over {total} "
            "self-test steps; "
            f"{len(found) - len(ran)} not run"
        )
    if others:
        raise typer.Exit(1)
