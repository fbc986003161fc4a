"""The life of a flight without a socket: every end has its sentence."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from mambo_codegen.settings.presets import preset
from mambo_sil.api.api_controller import Controller
from mambo_sil.errors import LinkError
from mambo_sil.life.checks import Preflight
from mambo_sil.life.courses import Place
from mambo_sil.life.life_cycle import ARM_S, CHECK_S, CONNECT_S, LifeCycle
from mambo_sil.life.phases import Phase
from mambo_sil.life.records import (
    ARDUCOPTER,
    COMPANION,
    PX4,
    Arm,
    AskParameter,
    Battery,
    Beat,
    Echo,
    EstimatedState,
    Heartbeat,
    Order,
    Parameter,
    Ping,
    Record,
    SetAttitude,
    SetMode,
    SetPosition,
    SetRate,
    Stack,
    Stream,
    Text,
)
from mambo_sil.life.steering import Steering, Update
from tests.support.links import controller

PERIOD_S = 0.01


def life_cycle() -> LifeCycle:
    """Return a flight that has not begun."""
    return LifeCycle(Steering(controller(), list[Update]().append), 1.0)


def beat(stack: Stack = PX4, *, armed: bool = False, mode: int = 0, vehicle: int = 2) -> Heartbeat:
    """Return a heartbeat of an autopilot."""
    return Heartbeat(1, 1, stack.ident, vehicle, armed, mode)


def estimate(
    time_s: float,
    height_m: float = 0.0,
    roll_rad: float = 0.0,
    north_m: float = 0.0,
    resets: int | None = None,
) -> EstimatedState:
    """Return an estimate at rest."""
    position_m, attitude_rad = np.array([north_m, 0.0, -height_m]), np.array([roll_rad, 0.0, 0.0])
    return EstimatedState(time_s, position_m, np.zeros(3), attitude_rad, resets)


class Ground:
    """A drone on the ground before a pilot, over time."""

    def __init__(self, life: LifeCycle, stack: Stack = PX4) -> None:
        self.life, self.stack, self.now_s = life, stack, 100.0
        self.orders: list[Order] = life.orders(self.now_s)
        self.trip_s = 0.0
        """Time from a question about the delay of the link to its answer."""
        self._asked: list[tuple[float, int]] = []

    def tell(self, *records: Record) -> None:
        """Let records come now."""
        for record in records:
            self.life.receive(record, self.now_s)
        self._listen()

    def _listen(self) -> None:
        """Take what is sent now, and answer what has come."""
        for asked_s, number in self._asked:
            if asked_s + self.trip_s <= self.now_s:
                self.life.receive(Echo(number), self.now_s)
        self._asked = [one for one in self._asked if one[0] + self.trip_s > self.now_s]
        sent = self.life.orders(self.now_s)
        self.orders += sent
        self._asked += [(self.now_s, order.number) for order in sent if isinstance(order, Ping)]

    def wait(
        self,
        duration_s: float,
        *,
        height_m: float = 0.0,
        every_s: float = PERIOD_S,
        north_m: float = 0.0,
        resets: int | None = None,
    ) -> None:
        """Let estimates come for a time."""
        for _ in range(round(duration_s / every_s)):
            self.now_s += every_s
            self.tell(estimate(self.now_s, height_m, north_m=north_m, resets=resets))

    def pass_silently(self, duration_s: float) -> None:
        """Let time pass without a message."""
        for _ in range(round(duration_s / PERIOD_S)):
            self.now_s += PERIOD_S
            self.orders += self.life.orders(self.now_s)

    def connect(self, hover: float = 0.5, options: float = 8.0) -> None:
        """Send heartbeat, parameters and estimates."""
        self.tell(beat(self.stack))
        self.tell(Parameter(self.stack.hover_parameter, hover), Parameter("GUID_OPTIONS", options))
        self.wait(0.6)

    @property
    def sentence(self) -> str:
        """How it ended."""
        assert self.life.end is not None
        assert not self.life.end.good
        return self.life.end.sentence

    @property
    def landed(self) -> str:
        """How it has ended, once the autopilot has landed."""
        assert self.life.phase is Phase.LANDING
        self.tell(beat(armed=True, mode=PX4.land), beat(armed=False, mode=PX4.land))
        return self.sentence


def kinds(orders: Sequence[Order]) -> set[type[Order]]:
    """Return the classes of orders."""
    return {type(order) for order in orders}


def flying() -> Ground:
    """Return a drone that the controller flies at 1 m."""
    ground = Ground(life_cycle())
    ground.connect()
    ground.wait(1.3)
    ground.tell(beat(armed=True, mode=PX4.guided))
    for height_m in (0.3, 0.6, 0.9):
        ground.wait(0.01, height_m=height_m)
    ground.wait(2.2, height_m=1.0)
    assert ground.life.phase is Phase.FLYING
    ground.orders.clear()
    return ground


def test_nothing_but_heartbeats_is_sent_before_an_autopilot_is_there() -> None:
    """Once a second."""
    ground = Ground(life_cycle())
    ground.pass_silently(3.0)
    assert ground.orders == [Beat()] * 4


def test_it_asks_for_estimates_and_parameters() -> None:
    """At the rate of the controller, until they come."""
    ground = Ground(life_cycle())
    ground.tell(beat())
    assert SetRate(Stream.ODOMETRY, 100.0) in ground.orders
    assert AskParameter("MPC_THR_HOVER") in ground.orders
    ground.pass_silently(1.0)
    assert ground.orders.count(AskParameter("MPC_THR_HOVER")) >= 2


def test_px4_gets_set_points_before_the_mode() -> None:
    """For a second, which it demands; then the mode and the arming again and again."""
    ground = Ground(life_cycle())
    ground.connect()
    ground.orders.clear()
    ground.wait(1.0)
    assert {SetPosition} <= kinds(ground.orders) <= {SetPosition, Beat}
    ground.wait(2.5)
    assert ground.orders.count(SetMode(PX4.guided)) >= 2
    assert ground.orders.count(Arm(arm=True)) >= 2


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (Heartbeat(1, 1, 8, 2, armed=False, mode=0), "neither PX4 nor ArduCopter (MAV_AUTOPILOT 8)"),
        (beat(vehicle=1), "flies no multicopter (MAV_TYPE 1)"),
        (beat(armed=True), "is armed already"),
        (Heartbeat(9, 191, 8, COMPANION, armed=False, mode=0), "another pilot is on the link (system 9"),
    ],
    ids=["autopilot", "plane", "armed", "second-pilot"],
)
def test_a_wrong_autopilot_is_refused(record: Record, words: str) -> None:
    """By its first heartbeat, and nothing is sent to it."""
    ground = Ground(life_cycle())
    ground.orders.clear()
    ground.tell(record)
    ground.pass_silently(2.0)
    assert words in ground.sentence
    assert ground.sentence.startswith("no flight: ")
    assert not ground.orders


def test_no_heartbeat_is_a_sentence() -> None:
    """After ten seconds."""
    ground = Ground(life_cycle())
    ground.pass_silently(CONNECT_S + 0.1)
    assert "no heartbeat has come within 10 s" in ground.sentence


@pytest.mark.parametrize(
    ("hover", "options", "stack", "words"),
    [
        (0.95, 8.0, PX4, "MPC_THR_HOVER = 0.95; it must lie in 0.05..0.9"),
        (
            0.5,
            1.0,
            ARDUCOPTER,
            "GUID_OPTIONS = 1, with which it takes the thrust for a climb rate; set it to 9",
        ),
    ],
    ids=["hover", "options"],
)
def test_parameters_are_checked(hover: float, options: float, stack: Stack, words: str) -> None:
    """Before the motors start."""
    ground = Ground(life_cycle(), stack)
    ground.connect(hover, options)
    assert words in ground.sentence


@pytest.mark.parametrize(("trip_s", "flies"), [(0.22, True), (0.26, False)], ids=["110-ms", "130-ms"])
def test_a_link_with_a_long_delay_is_refused(trip_s: float, flies: bool) -> None:
    """Of more than 120 ms each way, which half of what a question and its answer take says."""
    ground = Ground(life_cycle())
    ground.trip_s = trip_s
    ground.tell(beat(), Echo(-1), Echo(0), Echo(10**18))
    ground.connect()
    ground.wait(0.6)
    assert (ground.life.phase is Phase.ARMING) is flies
    if flies:
        assert ground.life.delay_s == pytest.approx(0.11, abs=0.006)
    else:
        assert "a message takes 130 ms each way; with more than 120 ms the drone may swing" in ground.sentence


def test_states_are_carried_ahead_rather_too_little_than_too_far() -> None:
    """Over 20 to 80 ms each way, by the quickest quarter of the answers: carried too far, a drone swings."""
    preflight = Preflight(ARDUCOPTER, 0.01)
    for number, trip_s in enumerate(np.linspace(0.04, 0.16, 21).tolist(), 1):
        preflight.ping(0.0)
        preflight.receive(Echo(number), trip_s)
    assert preflight.delay_s == pytest.approx(0.035)


def test_a_low_battery_is_refused() -> None:
    """Where the autopilot knows it."""
    ground = Ground(life_cycle())
    ground.tell(beat(), Battery(0.1))
    ground.connect()
    assert "the battery is at 10%; 20% are needed" in ground.sentence


def test_rare_estimates_are_refused() -> None:
    """At 20 Hz."""
    ground = Ground(life_cycle())
    ground.tell(beat(), Parameter("MPC_THR_HOVER", 0.5))
    ground.wait(2.6, every_s=0.05)
    assert "an estimate comes every 50 ms; the controller wants one every 10 ms" in ground.sentence


def test_a_tilted_drone_is_refused() -> None:
    """By 20 degrees."""
    ground = Ground(life_cycle())
    ground.tell(beat(), Parameter("MPC_THR_HOVER", 0.5))
    for step in range(60):
        ground.now_s += PERIOD_S
        ground.tell(estimate(ground.now_s, roll_rad=0.35))
        assert step < 59 or ground.life.end is not None
    assert "the drone is tilted by 20 degrees" in ground.sentence


@pytest.mark.parametrize(
    ("records", "words"),
    [([], "sends no MPC_THR_HOVER"), ([Parameter("MPC_THR_HOVER", 0.5)], "sends no position and attitude")],
    ids=["parameter", "estimate"],
)
def test_what_does_not_come_is_named(records: list[Record], words: str) -> None:
    """With what the autopilot said last."""
    ground = Ground(life_cycle())
    ground.tell(beat(), Text("EKF not ready"), *records)
    ground.pass_silently(CHECK_S + 0.1)
    assert words in ground.sentence
    assert ground.sentence.endswith("and says: EKF not ready")


def test_an_autopilot_that_does_not_arm_is_a_sentence() -> None:
    """With its own reason; it is told to land until no order to arm can still be on its way."""
    ground = Ground(life_cycle())
    ground.connect()
    ground.tell(Text("Preflight Fail: no manual control"))
    ground.wait(ARM_S + 0.1)
    assert ground.life.end is None
    assert SetMode(PX4.land) in ground.orders
    ground.tell(beat())
    assert ground.life.end is None
    ground.wait(2.0)
    ground.tell(beat())
    assert ground.sentence == (
        "no flight: PX4 did not arm within 15 s, and says: Preflight Fail: no manual control"
    )


def test_the_pilots_switch_ends_the_flight_with_one_message() -> None:
    """Nothing is sent after the heartbeat that shows another mode."""
    ground = flying()
    ground.wait(0.5, height_m=1.0)
    assert ground.orders
    ground.life.receive(beat(armed=True, mode=3 << 16), ground.now_s)
    ground.orders.clear()
    ground.wait(2.0, height_m=1.0)
    assert not ground.orders
    assert ground.sentence.startswith("PX4 has changed from OFFBOARD to POSITION")


def test_motors_that_stop_end_the_flight() -> None:
    """With what the autopilot says."""
    ground = flying()
    ground.tell(Text("Attitude failure detected"), beat(armed=False, mode=PX4.guided))
    assert ground.sentence == "PX4 has stopped the motors in flight, which says: Attitude failure detected"


def test_a_second_pilot_in_flight_makes_it_land() -> None:
    """Two would send set-points in turn."""
    ground = flying()
    ground.tell(Heartbeat(9, 191, 8, COMPANION, armed=False, mode=0))
    assert ground.life.phase is Phase.LANDING
    assert SetMode(PX4.land) in ground.orders
    assert ground.landed == "landed: another pilot is on the link (system 9, component 191)"


def test_a_dead_link_ends() -> None:
    """It lands, which nobody hears, and then says who flies."""
    ground = flying()
    ground.pass_silently(2.2)
    assert ground.life.phase is Phase.LANDING
    assert SetMode(PX4.land) in ground.orders
    ground.pass_silently(11.0)
    told = "PX4 was told to land for 10 s, which it has not confirmed"
    assert ground.sentence == f"the link is lost: {told}; it acts by its own failsafe"


@pytest.mark.parametrize(
    ("falling_m_s", "still"),
    [(0.0, "; it does not move: if it stands on the ground, stop its motors by your transmitter"), (0.5, "")],
)
def test_a_drone_that_is_never_disarmed_is_told_of(falling_m_s: float, still: str) -> None:
    """On the ground in strong wind some land detectors never fire."""
    ground = flying()
    ground.life.land("as planned", good=True)
    for _ in range(650):
        ground.now_s += 0.1
        moving = estimate(ground.now_s, 1.0)
        moving.velocity_m_s[2] = falling_m_s
        ground.tell(beat(armed=True, mode=PX4.land), moving)
    told = "PX4 was told to land for 62 s, and has not confirmed that it is disarmed"
    assert ground.sentence == f"NOT DISARMED: {told}{still} (ended: as planned)"


def test_an_autopilot_with_a_slow_clock_is_flown() -> None:
    """PX4's simulator falls behind by 1.2 %: 0.24 s in 20 s, and every estimate has its set-point."""
    ground = flying()
    for count in range(2000):
        ground.now_s += 1.012 * PERIOD_S
        ground.tell(estimate(ground.now_s - 0.012 * count * PERIOD_S, 1.0))
    assert ground.life.phase is Phase.FLYING
    assert len([order for order in ground.orders if isinstance(order, SetAttitude)]) > 1990


def test_the_state_out_of_range_makes_it_land() -> None:
    """The controller refuses it."""
    ground = flying()
    ground.wait(0.1, height_m=1.0, resets=0)
    ground.wait(1.0, height_m=1.0, north_m=9e5, resets=1)
    assert ground.landed == "landed: the controller refuses the state, which is out of its [ranges]"


@pytest.mark.parametrize(
    ("resets", "words"),
    [
        ((0, 0), "the estimate has jumped by 3.0 m within 10 ms without a reset of the estimator"),
        ((None, None), "the estimate has jumped by 3.0 m within 10 ms without a reset of the estimator"),
        ((7, 6), "the count of the estimator's resets has gone back from 7 to 6"),
    ],
    ids=["counted", "not-counted", "back"],
)
def test_an_estimate_that_jumps_without_a_reset_makes_it_land(
    resets: tuple[int | None, int | None], words: str
) -> None:
    """By 3 m; it is flown by no such estimate any more, but level until the autopilot lands."""
    ground = flying()
    ground.wait(0.1, height_m=1.0, resets=resets[0])
    ground.orders.clear()
    ground.wait(0.2, height_m=1.0, north_m=3.0, resets=resets[1])
    flown = [order for order in ground.orders if isinstance(order, SetAttitude)]
    assert flown
    assert not any(order.attitude_rad.any() for order in flown)
    assert ground.landed == f"landed: {words}; somebody else may send with its system number"


def test_a_drone_that_climbs_stays_where_it_was_believed() -> None:
    """The set-points until LAND have the last place and heading before an estimate that jumps by 10 m."""
    ground = Ground(life_cycle())
    ground.connect()
    ground.wait(1.3)
    ground.tell(beat(armed=True, mode=PX4.guided))
    ground.wait(0.1, height_m=0.4)
    assert ground.life.phase is Phase.CLIMBING
    ground.orders.clear()
    for _ in range(20):
        ground.now_s += PERIOD_S
        turned = np.array([0.0, 0.0, 1.0])
        ground.tell(replace(estimate(ground.now_s, 0.4, north_m=10.0), attitude_rad=turned))
    assert SetMode(PX4.land) in ground.orders
    sent = [order for order in ground.orders if isinstance(order, SetPosition)]
    assert len(sent) == 20
    for order in sent:
        np.testing.assert_array_equal(order.position_m, [0.0, 0.0, -0.4])
        assert order.yaw_rad == 0.0


@pytest.mark.parametrize(("resets", "jump_m"), [((255, 0), 30.0), ((None, None), 0.4)], ids=["px4", "copter"])
def test_a_reset_of_the_estimator_is_flown(resets: tuple[int | None, int | None], jump_m: float) -> None:
    """One that is counted, by any distance; where none is counted, one of less than half a metre."""
    ground = flying()
    ground.wait(0.1, height_m=1.0, resets=resets[0])
    ground.wait(0.5, height_m=1.0, north_m=jump_m, resets=resets[1])
    assert ground.life.phase is Phase.FLYING
    assert ground.life.steering.frame.jumps >= 1


def test_a_clock_far_ahead_is_not_the_autopilots() -> None:
    """Its own estimates are flown on, though one with a clock 1e6 s ahead comes at every fourth of them."""
    ground = flying()
    for count in range(400):
        ground.wait(0.01, height_m=1.0)
        if count % 4 == 0:
            ground.tell(estimate(ground.now_s + 1e6, 1.0, north_m=3.0))
    assert ground.life.phase is Phase.FLYING
    assert len([order for order in ground.orders if isinstance(order, SetAttitude)]) > 390


def test_a_target_too_far_makes_it_land() -> None:
    """Farther than the bound, where the drone is."""
    ground = flying()
    ground.life.fly(Place(np.array([25.0, 0.0, -1.0])))
    ground.wait(0.1, height_m=1.0)
    assert ground.landed == "landed: the target is 25 m away; farthest_m = 20"


def test_a_controller_without_the_thrust_is_refused() -> None:
    """The autopilot wants roll, pitch and thrust."""
    with pytest.raises(LinkError, match=r"the settings have no \[height\]"):
        Steering(Controller(preset("mambo")), list[Update]().append)
