"""A flight of an option of the settings on a board behind a serial line."""

from contextlib import closing
from functools import partial
from pathlib import Path

from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.serial_port import open_port
from mambo_sil.flight import loop
from tests.extensions.pil.support.serial_line import Faults, build_firmware, serial_line
from tests.support.option_flights import OptionFlights


def fly_on_line(flights: OptionFlights) -> None:
    """Compare the flight on a board with that on this machine."""
    elf = build_firmware(flights.settings, "host", Path("pil").absolute())
    flight = flights.flight()
    with serial_line(elf, Faults()) as line:
        connection = Connection(line.port, partial(open_port, line.port, 500000), flights.settings, say=print)
        with closing(connection):
            controller = BoardController(flights.settings, connection)
            assert loop.fly(flight, controller).same_bits(flights.trace)
            assert controller.different == []
