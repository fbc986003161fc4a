"""The command line `mambo-nmpc` with all its commands."""

import os
import signal
from collections.abc import Callable
from typing import Final, Never

import typer

from mambo_codegen.errors import Terminated
from mambo_sil.cli import generate as generating
from mambo_sil.cli.campaign import campaign
from mambo_sil.cli.command import examples, root
from mambo_sil.cli.design import design
from mambo_sil.cli.diff import diff
from mambo_sil.cli.doctor import doctor
from mambo_sil.cli.faults import faults
from mambo_sil.cli.fly import fly
from mambo_sil.cli.footprint import footprint
from mambo_sil.cli.identify import identify
from mambo_sil.cli.identify_binary import identify_binary
from mambo_sil.cli.options import FlyOptions, command_of
from mambo_sil.cli.playground import playground
from mambo_sil.cli.regress import regress
from mambo_sil.cli.replay_log import replay
from mambo_sil.cli.report import report
from mambo_sil.cli.same_bits import same_bits
from mambo_sil.cli.sweep import sweep
from mambo_sil.cli.table2 import table2
from mambo_sil.cli.tune import tune
from mambo_sil.cli.vehicles import vehicles
from mambo_sil.cli.verify import EXIT_CODES, verify

COMMANDS: Final[dict[str, Callable[..., None]]] = {
    "fly": command_of(FlyOptions, fly),
    "table2": table2,
    "footprint": footprint,
    "same-bits": same_bits,
    "sweep": sweep,
    "doctor": doctor,
    "vehicles": vehicles,
    "design": design,
    "faults": faults,
    "verify": verify,
    "regress": regress,
    "campaign": campaign,
    "tune": tune,
    "identify": identify,
    "replay": replay,
    "diff": diff,
    "identify-binary": identify_binary,
    "playground": playground,
    "report": report,
}
"""Commands by name, in the order of the help."""

EXAMPLES: Final = """\
mambo-nmpc fly
mambo-nmpc fly controller.toml --trajectory circle --yaw-rad 0.8 -o circle
mambo-nmpc fly --controller pd --push 0.5,0 -o pd-pushed
mambo-nmpc fly --on crazyflie -o on-crazyflie
mambo-nmpc fly controller.toml --port /dev/ttyACM0 -o on-the-board
mambo-nmpc fly controller.toml --port /dev/ttyACM0 --real-time --duration-s 20
mambo-nmpc fly --trajectory waypoints.csv --start take-off --duration-s 30
mambo-nmpc fly --sensors mambo --wind gusts --seed 7 -o as-on-the-mambo
mambo-nmpc fly --vehicle crazyflie --sensors mocap -o crazyflie
mambo-nmpc fly --vehicle my-drone.toml -o my-drone
mambo-nmpc fly --repeat worst.json -o again
mambo-nmpc table2 -o table2
mambo-nmpc table2 --scalar fixed -o fixed
mambo-nmpc table2 --sensors -o seen
mambo-nmpc footprint
mambo-nmpc footprint controller.toml --board crazyflie -o footprint
mambo-nmpc footprint --board my-board.toml --json
mambo-nmpc footprint controller.toml --port /dev/ttyACM0 -o measured
mambo-nmpc same-bits mambo --boards mambo,crazyflie
mambo-nmpc same-bits controller.toml --port /dev/ttyACM0
mambo-nmpc sweep --prediction 5:30:5 --control 1:3 --iterations 3,5,10 -o sweep
mambo-nmpc sweep --board rp2040 --fit
mambo-nmpc vehicles
mambo-nmpc vehicles generic > my-drone.toml
mambo-nmpc vehicles --schema > vehicle.schema.json
mambo-nmpc design crazyflie
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
mambo-nmpc tune -o tuned
mambo-nmpc tune tune.toml --trials 300 -o tuned
mambo-nmpc tune --vehicle my-drone.toml -o tuned-for-mine
mambo-nmpc tune --storage postgresql://db/studies -o tuned
mambo-nmpc identify --manoeuvre eight.py
mambo-nmpc identify flight.csv -o identified
mambo-nmpc identify monday.csv tuesday.csv -o identified
mambo-nmpc identify flight.csv --columns roll_rad=deg*att.roll,pitch_rad=-deg*att.pitch
mambo-nmpc identify flight.ulg -o identified
mambo-nmpc replay flight/trace.csv
mambo-nmpc replay flight.csv controller.toml -o replayed
mambo-nmpc diff mambo controller.toml
mambo-nmpc diff controller-old controller-new --vehicle crazyflie -o diff
mambo-nmpc identify-binary firmware.elf
mambo-nmpc identify-binary firmware.hex controller.toml controller-old
mambo-nmpc playground -o play.html
mambo-nmpc playground pd controller.toml --vehicle crazyflie -o mine.html
mambo-nmpc report flight
mambo-nmpc report table2 footprint faults verification -o controller.html
"""
"""The examples that the help of each command shows."""


def app() -> typer.Typer:
    """Return the root command with all its sub-commands."""
    joined = root()
    generating.register(joined)
    for name, command in COMMANDS.items():
        lines = [line for line in EXAMPLES.splitlines() if line.split()[1] == name]
        more = [EXIT_CODES] if name == "verify" else []
        joined.command(name, epilog=examples(*lines, *more) if lines else None)(command)
    return joined


def _terminate(*_: object) -> Never:
    """End the command on SIGTERM, with all that it does on Ctrl-C."""
    raise Terminated


def main() -> None:
    """Run the command line."""
    signal.signal(signal.SIGTERM, _terminate)
    os.environ["MPLBACKEND"] = "agg"  # plots go to files; matplotlib fails on a backend it does not know
    app()()
