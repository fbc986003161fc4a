"""What can go wrong between desk and board: it is noticed, told, and never flies another flight."""

import random
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen import __version__
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection, Patience
from mambo_extensions.pil.serial_port import open_port
from mambo_sil.errors import BoardError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.loop import Flight, fly
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES
from tests.extensions.pil.support.serial_line import Faults, build_firmware, edited, serial_line
from tests.support.command import run, unwrapped
from tests.support.tools import require_module

SETTINGS: Final = presets.preset("mambo")
FLIGHT: Final = Flight(CURVES["bernoulli"](2.0, 0.5), duration_s=0.6)
STEPS: Final = 61
QUICK: Final = Patience(reply_s=0.05, silence_s=2.0, return_s=2.0)
IMPATIENT: Final = Patience(reply_s=0.05, silence_s=0.2, return_s=0.2)


@pytest.fixture(scope="module")
def elf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the firmware for this machine."""
    return build_firmware(SETTINGS, "host", tmp_path_factory.mktemp("pil"))


@pytest.fixture(scope="module")
def desk() -> Trace:
    """Fly without a board."""
    return simulate(FLIGHT, CompiledController(SETTINGS))


def connect(port: str, said: list[str], patience: Patience = QUICK) -> Connection:
    """Connect to a board; what the user is told goes to `said`."""
    return Connection(port, partial(open_port, port, 500000), SETTINGS, say=said.append, patience=patience)


def fly_through(
    elf: Path, faults: Faults, desk: Trace, patience: Patience = QUICK
) -> tuple[dict[str, int], list[str]]:
    """Fly over a line with faults, and demand the flight of the desk; return the faults and what was told."""
    said: list[str] = []
    with serial_line(elf, faults) as line, closing(connect(line.port, said, patience)) as board:
        controller = BoardController(SETTINGS, board)
        assert fly(FLIGHT, controller).same_bits(desk)
    assert (len(controller.replies), controller.different) == (STEPS, [])
    return dict(board.faults), said


def spoil(seed: int, change: Callable[[int, random.Random], bytes]) -> Callable[[bytes], bytes]:
    """Return a function that changes one byte of 100."""
    draw = random.Random(seed)

    def spoiled(chunk: bytes) -> bytes:
        return b"".join(change(byte, draw) if draw.random() < 0.01 else bytes([byte]) for byte in chunk)

    return spoiled


CHANGES: Final[dict[str, Callable[[int, random.Random], bytes]]] = {
    "dropped": lambda _byte, _draw: b"",
    "flipped": lambda byte, draw: bytes([byte ^ (1 << draw.randrange(8))]),
    "doubled": lambda byte, _draw: bytes([byte, byte]),
    "inserted": lambda byte, draw: bytes([byte, draw.randrange(256)]),
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", CHANGES)
def test_spoiled_bytes_do_not_change_the_flight(name: str, elf: Path, desk: Trace) -> None:
    """One byte of 100 on either way: most frames are hit once, and repeated."""
    change = CHANGES[name]
    faults, said = fly_through(elf, Faults(spoil(1, change), spoil(2, change)), desk)
    assert faults["repeated"] > STEPS // 4
    assert faults["damaged"] > 0
    assert said == []


def every_third(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Return a function that changes every third chunk, which holds a whole frame."""
    count = 0

    def changed(chunk: bytes) -> bytes:
        nonlocal count
        count += 1
        return change(chunk) if count % 3 == 0 else chunk

    return changed


@pytest.mark.parametrize(
    "faults",
    [
        Faults(to_board=every_third(lambda chunk: chunk * 2)),
        Faults(from_board=every_third(lambda chunk: chunk * 2)),
    ],
    ids=["request", "reply"],
)
def test_a_doubled_frame_makes_no_second_step(faults: Faults, elf: Path, desk: Trace) -> None:
    """The board knows the number of its last step, and the desk that of its request."""
    unhurried = Patience()  # so that a busy machine repeats no request
    assert fly_through(elf, faults, desk, unhurried)[0] == {}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("way", ["to_board", "from_board"])
def test_a_lost_frame_is_repeated(way: str, elf: Path) -> None:
    """Of a lost reply the step was made: the board repeats its answer."""
    lost = every_third(lambda _chunk: b"")
    kept = Faults(to_board=lost) if way == "to_board" else Faults(from_board=lost)
    short = Flight(FLIGHT.trajectory, duration_s=0.2)
    with serial_line(elf, kept) as line, closing(connect(line.port, [])) as board:
        trace = fly(short, BoardController(SETTINGS, board))
    assert trace.same_bits(simulate(short, CompiledController(SETTINGS)))
    assert board.faults["repeated"] >= 7


@pytest.mark.long
def test_an_unplugged_board_is_awaited(elf: Path, desk: Trace) -> None:
    """It kept its power: the flight goes on where it was."""
    faults, said = fly_through(elf, Faults(unplugged=frozenset({20, 45})), desk)
    assert faults["reconnected"] == 2
    assert "restarts" not in faults
    assert len(said) == 2
    assert all("lost: " in words and "waiting 2 s for it" in words for words in said)


@pytest.mark.long
def test_a_restarted_board_flies_its_steps_again(elf: Path, desk: Trace) -> None:
    """It lost its power, and the state of its controller: all steps are sent again, twice."""
    faults, said = fly_through(elf, Faults(restarted=frozenset({20, 45})), desk)
    assert (faults["reconnected"], faults["restarts"]) == (2, 2)
    assert sum("was restarted; it flies its " in words for words in said) == 2


def test_a_board_that_stays_away_ends_the_flight(elf: Path) -> None:
    """The port is named, and no trace is made."""
    faults = Faults(unplugged=frozenset(range(30, 1000)))
    with (
        serial_line(elf, faults) as line,
        closing(connect(line.port, [], IMPATIENT)) as board,
        pytest.raises(BoardError, match=rf"^--port {line.port}: did not come back: .*; no flight is written"),
    ):
        fly(FLIGHT, BoardController(SETTINGS, board))


@pytest.mark.long
def test_a_board_that_restarts_with_other_firmware_is_refused(elf: Path, tmp_path: Path) -> None:
    """It would answer every step, with the bits of another controller."""
    other = build_firmware(with_option(SETTINGS, "limits.tilt_rad", 0.34), "host", tmp_path)
    faults = Faults(restarted=frozenset({30}), later=other)
    with (
        serial_line(elf, faults) as line,
        closing(connect(line.port, [])) as board,
        pytest.raises(BoardError, match=f"and this flight that of {SETTINGS.short_digest}; generate it"),
    ):
        fly(FLIGHT, BoardController(SETTINGS, board))


def test_other_firmware_is_refused_by_name(elf: Path) -> None:
    """Both settings digests, exit 2."""
    with serial_line(elf) as line:
        said = run("fly", "table1", "--port", line.port, "--duration-s", "1", code=2)[1]
    assert f"is that of settings {SETTINGS.short_digest}, and this flight that of " in said
    assert "mambo-nmpc generate --for pil" in said


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("path", "old", "new", "message"),
    [
        (
            "nmpc.h",
            f'"mambo-nmpc {__version__}"',
            '"mambo-nmpc 0.0.9"',
            rf"was generated by mambo-nmpc 0\.0\.9, and this is mambo-nmpc {__version__}; generate it",
        ),
        (
            "pil.h",
            "#define PIL_PROTOCOL 2U",
            "#define PIL_PROTOCOL 9U",
            "speaks version 9 of the protocol, and this is version 2; generate it",
        ),
        (
            "pil.c",
            "\\nfloat32\\n",
            "\\nfixed\\n",
            "computes in fixed, and this flight in float32",
        ),
        *(
            (
                "pil.c",
                f"put(end, self->{member}, 4U)",
                f"put(end, {number}UL, 4U)",
                rf"calls {cycles} cycles of {clock_hz} Hz its update period, and that is 0\.01 s",
            )
            for member, number, cycles, clock_hz in (
                ("clock_hz", 0, 10000000, 0),
                ("period", 0, 0, 1000000000),
                ("period", 10000002, 10000002, 1000000000),
            )
        ),
    ],
)
def test_another_version_is_refused_by_name(
    path: str, old: str, new: str, message: str, tmp_path: Path
) -> None:
    """Of the generator, and of the protocol."""
    elf = build_firmware(SETTINGS, "host", tmp_path, edited(path, old, new))
    with (
        serial_line(elf) as line,
        pytest.raises(BoardError, match=message),
    ):
        connect(line.port, [])


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("faults", "message"),
    [
        (Faults(from_board=lambda _chunk: b""), "does not answer, nothing came; check its supply"),
        (Faults(from_board=lambda _chunk: b"Hello!\r\n"), r"does not answer, \d+ B arrived, but no answer;"),
        (
            Faults(from_board=lambda chunk: bytes(b >> 1 for b in chunk)),
            r"\d+ B arrived, but no answer; check",
        ),
    ],
    ids=["silent", "other firmware", "other baud rate"],
)
def test_a_board_that_does_not_answer_is_told(faults: Faults, message: str, elf: Path) -> None:
    """With what to check, and whether anything came."""
    with serial_line(elf, faults) as line, pytest.raises(BoardError, match=message):
        connect(line.port, [], IMPATIENT)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("path", "edit", "message"),
    [
        (
            "nmpc.c",
            (
                "self->tilt_rad[0] = step->state->roll_rad",
                "self->tilt_rad[0] = 1.0000001f * step->state->roll_rad",
            ),
            "STEP 2 OF THE SELF-TEST HAS OTHER BITS THAN THE REFERENCE",
        ),
        (
            "pil.c",
            ("    ended =", "    command.roll_rad *= (self->steps < 7) ? 1.0f : 0.999f;\n    ended ="),
            "14 OF 21 STEPS HAVE OTHER BITS THAN ON THIS MACHINE, FIRST STEP 7",
        ),
        (
            "pil.c",
            ("    ended =", "    self->controller.steps_blind ^= 1U;\n    ended ="),
            "21 OF 21 STEPS HAVE OTHER BITS THAN ON THIS MACHINE, FIRST STEP 0",
        ),
        (
            "pil.c",
            ("(uint32_t)digest, 4U", "(uint32_t)digest ^ 1UL, 4U"),
            "THE SELF-TEST DIGEST OVER 400 STEPS IS NOT THAT OF THIS MACHINE",
        ),
    ],
    ids=["self-test", "command", "stored state", "digest"],
)
def test_other_bits_are_told_and_fail(
    path: str, edit: tuple[str, str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A board that computes otherwise: exit 1, and where the difference begins."""
    monkeypatch.chdir(tmp_path)

    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil", edited(path, *edit))) as line:
        said, _ = run("fly", "--port", line.port, "--duration-s", "0.2", "--no-pictures", code=1)
        assert message in unwrapped(said)
    run("report", "flight", "-o", "page.html")
    assert message.lower() in (tmp_path / "page.html").read_text("utf-8").lower()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--port", "/dev/no-such-port"], "--port /dev/no-such-port: cannot be opened: No such file"),
        (["--port", "socket://127.0.0.1:1"], "--port socket://127.0.0.1:1: cannot be opened: "),
        (
            ["--port", "telegraph://x"],
            "--port telegraph://x must be a device, such as /dev/ttyACM0, or socket",
        ),
        *(
            (
                ["--port", url],
                f"--port {url} must be a device, such as /dev/ttyACM0, or socket://HOST:PORT, such",
            )
            for url in (
                "socket://",
                "socket://localhost",
                "socket://:5000",
                "socket://localhost:0",
                "socket://localhost:5000/x",
                "socket://localhost:5000?logging=debug",
                "loop://",
                "spy://loop://?file=written",
            )
        ),
        (["--port", "socket://localhost:x"], "must be socket://HOST:PORT: Port could not be cast to integer"),
        (["--port", "socket://localhost:70000"], "must be socket://HOST:PORT: Port out of range 0-65535"),
        (["--port", "x", "--controller", "pd"], "--port x flies the C on a board: leave out --controller"),
        (["--port", "x", "--on", "mega"], "--port x flies the C on a board: leave out --controller and --on"),
        (["--port", "x", "--repeat", "y"], "contains the whole flight: leave out --port"),
        (
            ["--real-time"],
            "--real-time lets the clock of a board call the step: give its --port, or leave it out",
        ),
    ],
)
def test_a_port_that_cannot_be_is_refused(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit 2, and nothing is written."""
    require_module("serial")
    monkeypatch.chdir(tmp_path)
    assert message in run("fly", *arguments, code=2)[1]
    assert not list(tmp_path.iterdir())
