"""`fly --port`: the controller on a board flies the simulated drone."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing
from functools import partial

import typer

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.bundle.digest import TICKS
from mambo_codegen.errors import BuildError, echo
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.on_board import choose_board, measure_on_board
from mambo_extensions.pil.pil_report import BoardFlightSummary, EmulatedCount, board_fields
from mambo_extensions.pil.serial_port import open_port
from mambo_extensions.pil.timed import TimedController
from mambo_sil.board.firmware.elf import FootprintError
from mambo_sil.board.footprint.build_digests import BuildDigest, digest_text, reference_digest
from mambo_sil.board.footprint.measure import measure_footprint, usual_ticks
from mambo_sil.board.footprint.on_board import BoardMeasurement
from mambo_sil.cli.fly.fly_options import Conditions, Course, Output, Runner
from mambo_sil.cli.fly.one_flight import (
    FLIGHT_FILES,
    described_flight,
    finish,
    load_settings,
    named_source,
    summary_fields,
    write_flight,
    written,
)
from mambo_sil.cli.options import BAUD, load_drone
from mambo_sil.cli.progress import progress_bar
from mambo_sil.errors import FlightError
from mambo_sil.flight.controllers.compiled import digest_compiled
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.flight_report import judge
from mambo_sil.flight.scenario import Scenario
from mambo_sil.results.folders import new_results

EPISODES = 4
"""Episodes of the self-test digest before the flight: a second on the slowest board."""


def connect(port: str, baud: int | None, settings: Settings) -> AbstractContextManager[Connection]:
    """Connect to the board at `port`, whose faults go to stderr; raises BoardError."""
    say = partial(typer.echo, err=True)
    return closing(Connection(port, partial(open_port, port, baud or BAUD), settings, say=say))


def measure_at_port(
    settings: Settings, candidates: Sequence[Board], port: str, baud: int | None
) -> tuple[Board, BoardMeasurement]:
    """Return which of the candidates the board at `port` is, and what it measures; raises BoardError."""
    with connect(port, baud, settings) as connection:
        board = choose_board(candidates, port, connection.greeting.board)
        with progress_bar("flying") as progress:
            return board, measure_on_board(settings, connection, port, usual_ticks(settings), progress)


def run_at_port(
    settings: Settings, port: str, baud: int | None, episodes: int, progress: Callable[[float], None]
) -> Iterator[BuildDigest]:
    """Yield the digest of the reference, then of the board at `port`; call `progress` with the share done."""
    with connect(port, baud, settings) as connection:
        yield reference_digest(settings, episodes)
        digest = connection.digest(episodes, progress)
        yield BuildDigest("board", echo(connection.greeting.board), "", digest_text(digest))


def fly_on_port(course: Course, conditions: Conditions, runner: Runner, output: Output) -> None:
    """Fly once with the controller on a board; exit 1 if the drone is lost or a bit differs.

    Raises BoardError, and what `fly_once` raises.
    """
    port = str(runner.port)
    if runner.controller != "nmpc" or runner.on is not None:
        raise FlightError(f"--port {echo(port)} flies the C on a board: leave out --controller and --on")
    settings, drone = load_settings(runner), load_drone(conditions.vehicle, named_source(runner))
    flight = described_flight(course, conditions, runner, settings, drone)
    library = build_library(settings, host_toolchain())
    with new_results(output.output, BoardFlightSummary.command, FLIGHT_FILES) as folder:
        with connect(port, runner.baud, settings) as board:
            first_difference = board.test()
            same_digest = board.digest(EPISODES) == digest_compiled(library, EPISODES)
            controller = (TimedController if runner.real_time else BoardController)(settings, board)
            with progress_bar("flying") as progress:
                trace = simulate(flight, controller, progress)
        fields = summary_fields(course, conditions, runner, flight, settings)
        fields |= judge(trace, settings, drone, Scenario(), flight.trajectory)
        fields |= board_fields(board, controller)
        fields |= {"baud": runner.baud or BAUD} | _emulated(settings, board.greeting.board)
        summary = BoardFlightSummary(
            **fields
            | {
                "self_test_difference": first_difference,
                "same_digest": same_digest,
                "digest_steps": EPISODES * TICKS,
                "same_bits_as_host": not (first_difference or controller.different) and same_digest,
            }
        )
        write_flight(trace, summary, settings, output, folder, flight=flight)
        summary.write(folder)
    finish(summary, output, written(output))


def _emulated(settings: Settings, says: str) -> dict[str, object]:
    """Return what is counted on the emulated core of the board that `says` names, for the summary."""
    named = boards.called(says)
    if not named:
        return {}
    try:
        footprint = measure_footprint(settings, named[0])
    except (BuildError, FootprintError) as error:
        return {"not_emulated": str(error)}
    counts = footprint.counts
    if counts is None:
        return {"not_emulated": footprint.uncounted}
    count = EmulatedCount(board=named[0].name, least=counts.least, mean=counts.mean, most_met=counts.most_met)
    return {"emulated": count}
