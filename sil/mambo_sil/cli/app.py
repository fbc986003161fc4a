"""The command line `mambo-nmpc` with all its commands."""

import inspect
import logging
import os
import sys
import warnings
from collections.abc import Callable
from typing import Final

import typer

from mambo_codegen import extensions
from mambo_codegen.errors import BAD_INPUT, MamboNmpcError
from mambo_sil.cli.board import check_bits, footprint, sweep
from mambo_sil.cli.command import Command, JoinedCommand, examples, root
from mambo_sil.cli.evidence import VERIFY_EXIT_CODES, regress, report, table2, verify
from mambo_sil.cli.fly.commands import campaign, faults, fly, replay
from mambo_sil.cli.generate import generate, which_controller
from mambo_sil.cli.margins import margins
from mambo_sil.cli.settings import design, diff, identify, list_presets, schema, vehicles
from mambo_sil.cli.start import doctor, init
from mambo_sil.errors import UserNotice

PANELS: Final[dict[str, dict[str, Callable[..., None]]]] = {
    "Start": {"init": init, "doctor": doctor},
    "Settings": {
        "presets": list_presets,
        "schema": schema,
        "vehicles": vehicles,
        "identify": identify,
        "design": design,
        "diff": diff,
        "margins": margins,
    },
    "Generate": {"generate": generate, "which-controller": which_controller},
    "Fly": {"fly": fly, "campaign": campaign, "faults": faults, "replay": replay},
    "Board": {"footprint": footprint, "sweep": sweep, "check-bits": check_bits},
    "Evidence": {"verify": verify, "regress": regress, "table2": table2, "report": report},
}
"""The core's commands by name, in the panels and the order of the help."""

EXAMPLES: Final = """\
mambo-nmpc init
mambo-nmpc init table1 -o paper.toml
mambo-nmpc init -o - | less
mambo-nmpc schema > controller.schema.json
mambo-nmpc generate -o controller
mambo-nmpc generate controller.toml -o controller --prefix roll_pitch
mambo-nmpc generate controller.toml -o controller --check
mambo-nmpc generate --for crazyflie -o app
mambo-nmpc fly
mambo-nmpc fly controller.toml --trajectory circle --yaw-rad 0.8 -o circle
mambo-nmpc fly --controller pd --push 0.5,0 -o pd-pushed
mambo-nmpc fly --on crazyflie -o on-crazyflie
mambo-nmpc fly controller.toml --port /dev/ttyACM0 -o on-the-board
mambo-nmpc fly --trajectory waypoints.csv --start take-off --duration-s 30
mambo-nmpc fly --sensors mambo --wind gusts --seed 7 -o as-on-the-mambo
mambo-nmpc fly --vehicle crazyflie --sensors mocap -o crazyflie
mambo-nmpc fly --repeat worst.json -o again
mambo-nmpc fly controller.toml --app crazyflie --events camera-lost
mambo-nmpc table2 -o table2
mambo-nmpc table2 --scalar fixed -o fixed
mambo-nmpc table2 --sensors -o seen
mambo-nmpc footprint
mambo-nmpc footprint controller.toml --board crazyflie -o footprint
mambo-nmpc footprint --board mega --board my-board.toml --json
mambo-nmpc footprint controller.toml --port /dev/ttyACM0 -o measured
mambo-nmpc check-bits mambo --board mambo --board crazyflie
mambo-nmpc check-bits controller.toml --port /dev/ttyACM0
mambo-nmpc sweep --vary cost.response_time_s=0.1:0.5:5 -o sweep
mambo-nmpc sweep mambo-1norm --vary horizon.prediction=5:30:6 --vary optimizer.iterations=3:9:3 --fit
mambo-nmpc vehicles
mambo-nmpc vehicles generic > my-drone.toml
mambo-nmpc vehicles --schema > vehicle.schema.json
mambo-nmpc design crazyflie
mambo-nmpc design crazyflie --sensors flow-deck -o flow.toml
mambo-nmpc design identified/vehicle.toml -o controller.toml
mambo-nmpc faults mambo -o faults
mambo-nmpc faults --scalar fixed
mambo-nmpc verify
mambo-nmpc verify controller.toml -o evidence
mambo-nmpc verify controller.toml --only proof,rules --json
mambo-nmpc verify --scalar fixed
mambo-nmpc regress
mambo-nmpc regress my-suite.toml --controller controller.toml -o regress
mambo-nmpc regress my-suite.toml --controller controller.toml --update
mambo-nmpc campaign -o campaign
mambo-nmpc campaign campaign.toml --flights 200 -o campaign
mambo-nmpc campaign --vehicle crazyflie -o crazyflie
mambo-nmpc campaign --scheduler tcp://10.0.0.1:8786 -o campaign
mambo-nmpc identify --manoeuvre eight.py
mambo-nmpc identify flight.csv -o identified
mambo-nmpc identify monday.csv tuesday.csv -o identified
mambo-nmpc identify flight.csv --columns roll_rad=deg*att.roll,pitch_rad=-deg*att.pitch
mambo-nmpc identify flight.ulg -o identified
mambo-nmpc replay flight/trace.csv
mambo-nmpc replay flight.csv controller.toml -o replayed
mambo-nmpc diff mambo controller.toml
mambo-nmpc diff controller-old controller-new --vehicle crazyflie -o diff
mambo-nmpc margins
mambo-nmpc margins controller.toml --vehicle crazyflie --sensors mocap -o margins
mambo-nmpc margins --campaign default --drones 300
mambo-nmpc margins controller.toml --vehicle identified/vehicle.toml --uncertainty
mambo-nmpc which-controller firmware.elf
mambo-nmpc which-controller firmware.hex controller.toml controller-old
mambo-nmpc report flight
mambo-nmpc report table2 footprint faults verification -o controller.html
"""
"""The examples that the help of each command shows."""


def panels() -> dict[str, dict[str, Callable[..., None]]]:
    """Return all commands by name, in the panels and the order of the help."""
    found = {panel: list(commands.items()) for panel, commands in PANELS.items()}
    for name, joined in _joined().items():
        others = found[joined.panel]
        place = [other for other, _ in others].index(joined.after) + 1
        others.insert(place, (name, joined.run))
    return {panel: dict(commands) for panel, commands in found.items()}


def _joined() -> dict[str, JoinedCommand]:
    """Return the commands of extensions by name."""
    return extensions.load_all("commands")


def app() -> typer.Typer:
    """Return the root command with all its sub-commands."""
    shown_lines = "".join([EXAMPLES, *(one.examples for one in _joined().values())]).splitlines()
    made = root()
    for panel, commands in panels().items():
        for name, command in commands.items():
            lines = [line for line in shown_lines if line.split()[1] == name]
            more = [VERIFY_EXIT_CODES] if name == "verify" else []
            epilog = examples(*lines, *more) if lines else None
            what, when, *rest = (inspect.getdoc(command) or "").split("\n\n")
            shown = "\n\n".join((f"{what}\n{when}", *rest))
            add = made.command(
                name, cls=Command, help=shown, short_help=what, epilog=epilog, rich_help_panel=panel
            )
            add(command)
    return made


def main() -> None:
    """Run the command line; what libraries warn programmers of is not for its users."""
    os.environ["MPLBACKEND"] = "agg"  # plots go to files; matplotlib fails on a backend it does not know
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
        warnings.simplefilter("default", UserNotice)
    if extensions.are_older_than_sources():
        typer.echo(f"extensions are missing: the installed metadata are older; {extensions.AGAIN}", err=True)
    try:
        command = app()
    except MamboNmpcError as error:  # an extension that is not there
        typer.echo(str(error), err=True)
        sys.exit(BAD_INPUT)
    command()
