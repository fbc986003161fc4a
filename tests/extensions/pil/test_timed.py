"""Flights in which the board's own clock calls the step: their bits, and what can go wrong on the way."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.board_controller import BoardStep
from mambo_extensions.pil.connection import Connection, Patience
from mambo_extensions.pil.pil_report import real_time_of, real_time_text, wall_clock
from mambo_extensions.pil.protocol import NAMED_STEPS, OUT_OF_STEP, REPLY, Kind, StepReply, TimedReply
from mambo_extensions.pil.timed import OLDEST_INPUTS, Arrival, TimedController
from mambo_sil.drone.plant.link import NOT_CALLED, Link
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import BoardError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.loop import Flight, fly
from mambo_sil.flight.trajectories import CURVES
from tests.extensions.pil.support.lockstep import LockstepPort, TimedFaults, build_lockstep
from tests.extensions.pil.support.serial_line import edited
from tests.support.height_settings import height_settings

SETTINGS: Final = presets.preset("mambo")
FLIGHT: Final = Flight(CURVES["bernoulli"](2.0, 0.5), duration_s=0.6)
STEPS: Final = 60
"""Of the board: the first update has no command yet."""
PATIENT: Final = Patience(reply_s=20.0, silence_s=60.0)
QUICK: Final = Patience(reply_s=0.05, silence_s=0.5)


@pytest.fixture(scope="module")
def elf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the firmware for a process in lockstep."""
    return build_lockstep(SETTINGS, tmp_path_factory.mktemp("lockstep"))


def connect(
    elf: Path, faults: TimedFaults | None = None, patience: Patience = PATIENT, settings: Settings = SETTINGS
) -> Connection:
    """Connect to a board in lockstep."""
    return Connection(
        "line", lambda: LockstepPort(elf, faults or TimedFaults()), settings, say=print, patience=patience
    )


@dataclass
class Expected:
    """A controller in place of the board: what it does at the end of each of its periods.

    The step of period k + 1 uses the inputs of update k, or of update `used[k]`; its reply is lost if k is in
    `lost`. Periods in `without_step` have none.
    """

    settings: Settings = SETTINGS
    used: dict[int, int] = field(default_factory=dict)
    lost: frozenset[int] = frozenset()
    without_step: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        """Begin with a command of zero."""
        self._compiled, self._seen = CompiledController(self.settings), list[tuple[ArrayLike, ...]]()
        hover = None if self.settings.height is None else np.array([GRAVITY_M_S2])
        self._held = BoardStep(np.zeros((1, 2)), np.array([NOT_CALLED]), hover)
        self._reported: ArrayLike = [np.nan]

    def report_thrust(self, thrust_m_s2: ArrayLike) -> None:
        """Keep it for the next step, with a height."""
        self._reported = thrust_m_s2

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> BoardStep:
        """Return what the drone is commanded from this update on."""
        before = len(self._seen) - 1
        reported, self._reported = self._reported, [np.nan]
        self._seen.append(
            (state, target, reported if thrust_acceleration_m_s2 is None else thrust_acceleration_m_s2)
        )
        if before < 0 or before in self.without_step:
            return self._held
        measured, aim, thrust = self._seen[self.used.get(before, before)]
        if self.settings.height is None:
            step = self._compiled.step(measured, aim, thrust)
        else:
            self._compiled.report_thrust(thrust)
            step = self._compiled.step(measured, aim)
        if before in self.lost:
            return self._held
        thrust_m_s2 = getattr(step, "thrust_m_s2", None)
        self._held = BoardStep(step.command_rad, np.array([NOT_CALLED]), thrust_m_s2)
        return BoardStep(step.command_rad, step.status, thrust_m_s2)


def flown(
    elf: Path, faults: TimedFaults, expected: Expected, patience: Patience = PATIENT
) -> tuple[TimedController, dict[str, int]]:
    """Fly over a line with faults, and demand the expected flight and every bit; return what was counted."""
    with closing(connect(elf, faults, patience)) as board:
        controller = TimedController(SETTINGS, board)
        assert fly(FLIGHT, controller).same_bits(fly(FLIGHT, expected))
    assert controller.different == []
    return controller, dict(board.faults)


def test_a_flight_without_faults_is_that_of_the_desk_with_a_delay(elf: Path) -> None:
    """Inputs one update old, in every bit of the trace; the drone moves as with commands one update late."""
    with closing(connect(elf)) as board:
        controller = TimedController(SETTINGS, board)
        trace = fly(FLIGHT, controller)
    assert trace.same_bits(fly(FLIGHT, Expected()))
    link = Link(delay_ticks=FLIGHT.ticks_per_update)
    late = simulate(Flight(FLIGHT.trajectory, FLIGHT.duration_s, link=link), CompiledController(SETTINGS))
    assert np.array_equal(trace.position_m, late.position_m)
    assert np.array_equal(trace.command_rad[1:], late.command_rad[:-1])
    assert (len(controller.replies), controller.different, dict(board.faults)) == (STEPS, [], {})
    real_time = real_time_of(board, controller)
    assert (real_time.late_inputs, real_time.lost_replies, real_time.overruns) == (0, 0, 0)
    assert real_time.board_period_s == 0.01
    assert real_time.delay_s.most == 0.0


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("preset", "scalar"), [("mambo", "float64"), ("mambo", "fixed"), ("mambo-1norm", "float32")]
)
def test_every_scalar_type_and_norm_flies_by_the_boards_clock(
    preset: str, scalar: str, tmp_path: Path
) -> None:
    """With the bits of the delayed flight."""
    settings = with_option(presets.preset(preset), "code.scalar", scalar)
    flight = Flight(FLIGHT.trajectory, duration_s=0.2)
    with closing(connect(build_lockstep(settings, tmp_path), settings=settings)) as board:
        controller = TimedController(settings, board)
        assert fly(flight, controller).same_bits(fly(flight, Expected(settings)))
    assert (len(controller.replies), controller.different) == (20, [])


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", pytest.param("float64", marks=pytest.mark.long)])
def test_a_height_flies_by_the_boards_clock(scalar: str, tmp_path: Path) -> None:
    """Two metres up at once, which the mixer caps now and then: with the bits of the delayed flight."""
    settings = height_settings(scalar)
    curve, vehicle = CURVES["height-step"](2.0, 0.5), Vehicle.from_preset("crazyflie")
    flight = Flight(curve, duration_s=0.5, vehicle=vehicle, yaw_rad=np.array([1.5]))
    with closing(connect(build_lockstep(settings, tmp_path), settings=settings)) as board:
        controller = TimedController(settings, board)
        assert fly(flight, controller).same_bits(fly(flight, Expected(settings)))
    assert (len(controller.replies), controller.different) == (50, [])


def at(numbers: set[int], change: Callable[[bytes], bytes]) -> Callable[[int, bytes], bytes]:
    """Return a function that changes the frames with these numbers."""
    return lambda number, frame: change(frame) if number in numbers else frame


def drop(_frame: bytes) -> bytes:
    """Lose a frame."""
    return b""


def damage(frame: bytes) -> bytes:
    """Flip a bit in the middle of a frame, and leave no zero more."""
    middle = len(frame) // 2
    return frame[:middle] + bytes([frame[middle] ^ 2 or 1]) + frame[middle + 1 :]


@pytest.mark.parametrize(("change", "faults"), [(drop, {}), (damage, {"damaged": 3})])
def test_inputs_that_do_not_arrive_are_late(
    change: Callable[[bytes], bytes], faults: dict[str, int], elf: Path
) -> None:
    """The board goes on with those it has, and the desk with the same ones; three steps are counted."""
    expected = Expected(used={10: 9, 30: 29, 31: 29})
    controller, counted = flown(elf, TimedFaults(inputs=at({10, 30, 31}, change)), expected)
    assert (controller.late_inputs, controller.lost_replies, counted) == (3, 0, faults)
    assert len(controller.replies) == STEPS


def test_doubled_frames_change_nothing(elf: Path) -> None:
    """On either way; those of the board are counted."""
    double = at({0, 7, 20, 21}, lambda frame: frame * 2)
    controller, counted = flown(elf, TimedFaults(double, double), Expected())
    assert (controller.late_inputs, controller.lost_replies, counted) == (0, 0, {"doubled": 4})


def test_inputs_that_come_out_of_order_are_not_used(elf: Path) -> None:
    """Older ones behind newer ones; a start while the clock runs."""
    kept = list[bytes]()

    def swap(number: int, frame: bytes) -> bytes:
        kept.append(frame)
        return frame + kept[-3] + kept[0] if number == 25 else frame

    controller, counted = flown(elf, TimedFaults(inputs=swap), Expected())
    assert (controller.late_inputs, controller.lost_replies, counted) == (0, 0, {})


@pytest.mark.parametrize(("change", "faults"), [(drop, {}), (damage, {"damaged": 9})])
def test_lost_replies_are_made_good_by_the_numbers_of_their_inputs(
    change: Callable[[bytes], bytes], faults: dict[str, int], elf: Path
) -> None:
    """As many in a row as a reply names: the drone keeps its command, the desk makes the same steps."""
    in_a_row = set(range(30, 30 + NAMED_STEPS - 1))
    lost = frozenset({5, 12} | in_a_row)
    used = {6: 5, 13: 12, **{step + 1: 30 for step in in_a_row}}
    controller, counted = flown(elf, TimedFaults(reply=at(set(lost), change)), Expected(used=used, lost=lost))
    assert (controller.late_inputs, controller.lost_replies, counted) == (0, 9, faults)
    assert len(controller.replies) == STEPS - 9


def test_lost_inputs_among_lost_replies_are_known_too(elf: Path) -> None:
    """The inputs of update 20 are lost, and then the replies to the step without them and to the next one."""
    expected = Expected(used={20: 19, 21: 19, 22: 19}, lost=frozenset({20, 21}))
    faults = TimedFaults(at({20}, drop), at({20, 21}, drop))
    controller, _ = flown(elf, faults, expected)
    assert (controller.late_inputs, controller.lost_replies) == (1, 2)


def test_a_lost_start_is_repeated(elf: Path) -> None:
    """No step was made: the flight begins a little later."""
    frames = iter([drop])
    faults = TimedFaults(inputs=lambda _, frame: next(frames, bytes)(frame))
    controller, _ = flown(elf, faults, Expected(), Patience(reply_s=0.5, silence_s=60.0))
    assert (controller.late_inputs, controller.lost_replies) == (0, 0)


def test_periods_without_a_step_are_flown_with_the_last_command(tmp_path: Path) -> None:
    """Every tenth time the board is busy for three periods, and its next step has inputs as old."""
    elf = build_lockstep(SETTINGS, tmp_path, cycles="((periods % 10UL) == 0UL) ? 30UL : 10UL")
    without = frozenset(12 * k + wait for k in range(5) for wait in (9, 10))
    expected = Expected(used={12 * k + 11: 12 * k + 9 for k in range(5)}, without_step=without)
    controller, counted = flown(elf, TimedFaults(), expected)
    assert (controller.late_inputs, controller.lost_replies, counted) == (0, 0, {})
    assert controller.arrivals[-1].reply.overruns == len(without)
    assert len(controller.replies) + len(without) == STEPS


def test_a_late_step_does_not_move_the_next_period(tmp_path: Path) -> None:
    """Step 4 is 4 cycles late, and so are those after it until one comes sooner; none is left out."""
    elf = build_lockstep(SETTINGS, tmp_path, cycles="(periods == 5UL) ? 14UL : (periods == 8UL) ? 6UL : 10UL")
    controller, _ = flown(elf, TimedFaults(), Expected())
    delays = [arrival.reply.delay_cycles for arrival in controller.arrivals]
    assert delays[:9] == [0, 0, 0, 0, 4, 4, 4, 0, 0]
    assert controller.arrivals[-1].reply.overruns == 0


def test_the_next_start_is_a_new_one(tmp_path: Path) -> None:
    """Of periods without a step, late steps and numbers of inputs before it is nothing left."""
    elf = build_lockstep(SETTINGS, tmp_path, cycles="(periods == 5UL) ? 34UL : 10UL")
    with closing(connect(elf)) as board:
        first = TimedController(SETTINGS, board)
        fly(FLIGHT, first)
        assert board.test() == 0
        second = TimedController(SETTINGS, board)
        assert fly(FLIGHT, second).same_bits(fly(FLIGHT, Expected()))
    ends = [(flight.arrivals[-1].reply.overruns, flight.replies[-1].status) for flight in (first, second)]
    assert ends == [(2, 0), (0, 0)]
    assert [arrival.reply.delay_cycles for arrival in second.arrivals] == [0] * STEPS


def test_a_clock_that_is_beyond_the_end_of_the_flight_ends_it(tmp_path: Path) -> None:
    """The board is busy for 100 periods: the drone flies to its end with the last command."""
    elf = build_lockstep(SETTINGS, tmp_path, cycles="(periods == 20UL) ? 1000UL : 10UL")
    expected = Expected(without_step=frozenset(range(19, STEPS)))
    controller, _ = flown(elf, TimedFaults(), expected)
    assert controller.arrivals[-1].period > STEPS


def refused(elf: Path, faults: TimedFaults, message: str, flight: Flight = FLIGHT) -> None:
    """Demand that a flight over a line with faults ends with this message."""
    with (
        closing(connect(elf, faults, QUICK)) as board,
        pytest.raises(
            BoardError, match=rf"^--port line: {message}; a flight in real time cannot be repeated"
        ),
    ):
        fly(flight, TimedController(SETTINGS, board))


def test_more_lost_replies_than_can_be_made_good_end_the_flight(elf: Path) -> None:
    """The inputs of one step are not known."""
    lost = set(range(30, 30 + NAMED_STEPS))
    refused(elf, TimedFaults(reply=at(lost, drop)), "8 replies in a row were lost, .*check wires and --baud")


def test_a_board_that_receives_nothing_ends_the_flight(elf: Path) -> None:
    """Its steps go on with inputs that get older and older."""
    deaf = TimedFaults(inputs=lambda number, frame: frame if number < 40 else b"")
    long = Flight(FLIGHT.trajectory, duration_s=4.0)
    refused(
        elf,
        deaf,
        f"the board did not receive the last {OLDEST_INPUTS} inputs in time; check the wire .*",
        long,
    )


@pytest.mark.long
def test_inputs_are_known_until_then(elf: Path) -> None:
    """Numbers of which a reply has the lowest byte only."""
    missed = range(300, 300 + OLDEST_INPUTS)
    faults = TimedFaults(inputs=lambda number, frame: b"" if number in missed else frame)
    long = Flight(FLIGHT.trajectory, duration_s=6.0)
    with closing(connect(elf, faults)) as board:
        controller = TimedController(SETTINGS, board)
        assert fly(long, controller).same_bits(fly(long, Expected(used=dict.fromkeys(missed, 299))))
    assert (controller.different, controller.late_inputs) == ([], OLDEST_INPUTS)


def test_a_board_that_is_restarted_ends_the_flight(elf: Path) -> None:
    """It answers the next inputs that its clock does not run."""
    refused(elf, TimedFaults(restarted=frozenset({30})), "the board was restarted; check its supply")


def test_a_board_that_is_unplugged_ends_the_flight(elf: Path) -> None:
    """At once."""
    refused(elf, TimedFaults(unplugged=frozenset({30})), "lost: Input/output error")


def test_a_board_that_falls_silent_ends_the_flight(elf: Path) -> None:
    """Without an answer to the repeated inputs."""
    silent = TimedFaults(reply=lambda number, frame: None if number == 30 else frame)
    refused(elf, silent, r"no reply for 0\.5 s")


def test_other_bits_are_counted(tmp_path: Path) -> None:
    """Of a step whose reply comes; of a lost one they show in what the next one leaves."""
    flip = "if (self->steps == 20UL) {\n ((uint8_t *)&self->controller)[0] ^= 1U;\n }\n"
    change = edited("pil.c", "    ended =", f"{flip} ended =")
    elf = build_lockstep(SETTINGS, tmp_path, change)
    for lost, first in ((set[int](), 20), ({20}, 21)):
        with closing(connect(elf, TimedFaults(reply=at(lost, drop)))) as board:
            controller = TimedController(SETTINGS, board)
            fly(FLIGHT, controller)
        assert controller.different[:1] == [first]


def test_a_reply_with_inputs_that_were_never_sent_ends_the_flight(tmp_path: Path) -> None:
    """A number that is one too high."""
    change = edited("pil.c", "(self->inputs_number & 0xFFUL)", "((self->inputs_number + 1UL) & 0xFFUL)")
    refused(build_lockstep(SETTINGS, tmp_path, change), TimedFaults(), "the reply to step 0 contradicts .*")


def test_no_step_is_made_on_request_while_the_clock_runs(elf: Path) -> None:
    """Not even the next one; the self-test stops the clock, and the next flight is a new one."""
    with closing(connect(elf)) as board:
        fly(Flight(FLIGHT.trajectory, duration_s=0.1), TimedController(SETTINGS, board))
        board.tell(Kind.STEP, 11, bytes(68))
        heard = list[tuple[int, int, bytes]]()
        while len(heard) < 2:
            heard += board.hear()
        assert [(kind, number) for kind, number, _ in heard] == [(Kind.START | REPLY, 10), (OUT_OF_STEP, 11)]
        assert board.test() == 0
        assert fly(FLIGHT, TimedController(SETTINGS, board)).same_bits(fly(FLIGHT, Expected()))


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("period_s", "cycles"), [(0.0149, 15), (0.0151, 15), (1 / 300, 3), (0.2, 200)])
def test_the_period_is_rounded_to_the_clock_of_the_board(
    period_s: float, cycles: int, tmp_path: Path
) -> None:
    """To the nearest cycle, here of 1000 Hz; the greeting tells it."""
    settings = with_option(SETTINGS, "horizon.update_period_s", period_s)
    with closing(connect(build_lockstep(settings, tmp_path), settings=settings)) as board:
        assert (board.greeting.period_cycles, board.period_s) == (cycles, cycles / 1000)


def arrivals(times_s: list[float]) -> list[Arrival]:
    """Return replies that come at these times."""
    step = StepReply(0, b"", 0, 0, 0)
    return [Arrival(number, TimedReply(step, 0, 0, b""), time_s) for number, time_s in enumerate(times_s)]


@pytest.mark.parametrize(
    ("times_s", "period_s", "agree"),
    [
        ([0.0], None, True),
        ([0.0, 0.5, 1.0, 1.5], 0.5, True),
        ([0.0, 0.505, 1.01, 1.515], 0.505, True),
        ([0.0, 0.51, 1.02, 1.53], 0.51, False),
        ([0.0, 0.5, 1.0, 1.5, 2.0, 2.8], 0.5, True),
        ([0.0, 0.05, 0.1, 0.15], 0.05, False),
    ],
    ids=["one reply", "equal", "within a percent", "beyond", "a late reply", "ten times as fast"],
)
def test_the_clocks_are_compared(times_s: list[float], period_s: float | None, agree: bool) -> None:
    """A late reply is no other clock."""
    measured, found = wall_clock(arrivals(times_s), 0.5)
    assert measured == (period_s if period_s is None else pytest.approx(period_s))
    assert found == agree


def test_what_is_told(elf: Path) -> None:
    """The clocks, and the counts."""
    with closing(connect(elf, TimedFaults(at({9}, drop), at({20, 21}, drop)))) as board:
        controller = TimedController(SETTINGS, board)
        fly(FLIGHT, controller)
    timed = real_time_of(board, controller).model_copy(
        update={"wall_period_s": 0.0123, "clocks_agree": False}
    )
    assert real_time_text(timed, len(controller.replies)) == [
        "a step every 10 ms of the board's clock, 12.3 ms of this machine's: THE CLOCKS DISAGREE",
        "called 0 / 0 / 0 ms after the end of a period (least, median, most)",
        "1 of 60 steps with late inputs, 2 replies lost, 0 periods without a step",
    ]
