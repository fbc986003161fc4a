"""Flights of the pilot with an autopilot of our own behind a UDP socket of the loopback."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.flights.wire import Faults, WiredLink
from mambo_extensions.mavlink.pilot import Pilot
from mambo_extensions.mavlink.pilot_report import write_log
from mambo_extensions.mavlink.simulated import STARTS_M, Condition
from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import PilotError
from mambo_sil.flight.frames import wrapped
from mambo_sil.flight.states import TargetState
from mambo_sil.flight.trajectories import Circle, Gerono
from mambo_sil.life.courses import Place
from mambo_sil.life.phases import Phase
from mambo_sil.life.records import PX4, STACKS, Arm, SetAttitude, SetMode, px4_mode
from mambo_sil.life.steering import Update
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.replay.log_replay import replay_log
from tests.extensions.mavlink.support.pilots import simulated
from tests.support.derived import settings_for
from tests.support.links import controller, drone

BOTH = tuple(STACKS)


def horizontal_rms_m(updates: list[Update], settled_s: float = 2.0) -> float:
    """Return the rms of the error in the plane, after a time."""
    time_s = np.array([one.estimate.time_s for one in updates])
    error_m = np.array([one.estimate.position_m - one.target.position_m for one in updates])[:, :2]
    return float(np.sqrt(np.mean(np.sum(error_m[time_s > time_s[0] + settled_s] ** 2, axis=1))))


@pytest.mark.first_is_quick
@pytest.mark.parametrize("stack", BOTH)
def test_a_curve_is_flown_and_the_log_repeats_it(stack: str, tmp_path: Path) -> None:
    """From the ground to the ground, near the curve; hover is learnt; the log is one of the controller."""
    pilot, autopilot, updates = simulated(stack)
    with pilot:
        pilot.take_off(1.0)
        pilot.fly(Gerono(1.0, 0.8), 6.0)
        assert pilot.land() == "landed: as planned"
    assert autopilot.is_on_ground
    assert not autopilot.armed
    assert horizontal_rms_m(updates) < 0.02
    assert pilot.steering.mean_thrust == pytest.approx(0.52, abs=0.005)
    assert (pilot.steering.take_overs, pilot.steering.frame.jumps) == (1, 0)
    log = tmp_path / "flight.csv"
    write_log(updates, log)
    replay = replay_log(log, {}, pilot.steering.controller.settings)
    assert replay.is_exact
    assert replay.from_start
    np.testing.assert_array_equal(replay.replayed_rad, replay.logged_rad)


@pytest.mark.long
def test_a_program_flies_to_places_with_headings_and_follows_its_targets() -> None:
    """North of the place of take-off with the nose to the east, then a line; the truth is there."""
    pilot, autopilot, _ = simulated("px4")
    with pilot:
        pilot.take_off(1.0)
        assert pilot.go_to((1.0, 0.0, -1.5), yaw_rad=1.5)
        np.testing.assert_allclose(autopilot.true.position_m[:, 0] - STARTS_M, [1.0, 0.0, -1.5], atol=0.15)
        assert autopilot.true.euler_rad[2, 0] == pytest.approx(1.5, abs=0.05)
        pilot.follow(lambda time_s: TargetState([1.0, 0.3 * time_s, -1.5], [0.0, 0.3, 0.0], np.zeros(3)), 3.0)
        assert autopilot.true.position_m[1, 0] - STARTS_M[1] == pytest.approx(0.9, abs=0.1)
        assert not pilot.go_to((15.0, 0.0, -1.5), within_s=0.5)
    assert not autopilot.armed
    assert SetMode(PX4.land) in autopilot.orders


@pytest.mark.long
def test_a_heading_that_turns_costs_little_on_a_circle() -> None:
    """The nose follows the path at 1.5 rad/s, and its loop lags by 0.3 rad, which turns no tilt.

    If it did, the drone would be 11 cm off.
    """
    pilot, _, updates = simulated("ardupilot")
    with pilot:
        pilot.take_off(1.0)
        pilot.follow(ahead_on_a_circle, 9.0)
        pilot.land()
    flown = [one for one in updates if one.target.velocity_m_s[:2].any()]
    assert horizontal_rms_m(flown, settled_s=4.0) < 0.06


def ahead_on_a_circle(time_s: float) -> TargetState:
    """Return a target on a circle of 1 m, with its nose ahead; it reaches 1.5 rad/s within 3 s."""
    soft_s = min(time_s, 3.0)
    rate, change = 0.5 * soft_s, 0.5 if time_s < 3.0 else 0.0
    angle = 0.25 * soft_s * soft_s + 1.5 * (time_s - soft_s)
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    right = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return TargetState(
        [ahead[1], 1.0 - ahead[0], -1.0],
        rate * ahead,
        change * ahead + rate * rate * right,
        float(wrapped(angle)),
    )


@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
def test_a_bad_link_costs_little(stack: str) -> None:
    """Of both directions a fifth is lost, a tenth late, a tenth doubled, a tenth followed by garbage."""
    link, updates = WiredLink(stack, drone(), seed=3), list[Update]()
    link.wire.to_pilot = link.wire.to_autopilot = Faults(lost=0.2, late=0.1, doubled=0.1, garbage=0.1)
    pilot = Pilot(controller(), lambda: link, updates.append)
    with pilot:
        pilot.take_off(1.0)
        pilot.fly(Circle(0.5, 1.0), 5.0)
        assert pilot.land() == "landed: as planned"
    assert horizontal_rms_m(updates) < 0.06
    assert np.diff([one.estimate.time_s for one in updates]).min() > 0.0


@pytest.mark.first_is_quick
@pytest.mark.parametrize("stack", BOTH)
def test_a_link_on_which_messages_overtake_each_other_is_flown(stack: str) -> None:
    """Each way a fifth is lost, and all are 50 to 80 ms late: it takes off, flies, lands, and says so."""
    link, updates = WiredLink(stack, drone(), seed=1), list[Update]()
    link.wire.to_pilot = link.wire.to_autopilot = Faults(lost=0.2, delay_s=0.05, jitter_s=0.03)
    with Pilot(controller(), lambda: link, updates.append) as pilot:
        pilot.take_off(1.0)
        pilot.fly(Circle(0.5, 1.0), 2.0)
        assert pilot.land() == "landed: as planned"
    assert not link.autopilot.armed
    assert horizontal_rms_m(updates) < 0.35
    assert np.diff([one.estimate.time_s for one in updates]).min() > 0.0


@pytest.mark.long
def test_the_delay_of_a_link_is_counted_on() -> None:
    """Of 100 ms each way, which no settings know: the circle is flown calmly.

    A pilot that does not count on it is 24 cm off, and swings.
    """
    link, updates, tilts_rad = WiredLink("px4", drone()), list[Update](), list[float]()
    link.wire.to_pilot = link.wire.to_autopilot = Faults(delay_s=0.1)

    def watch(pilot: Pilot) -> None:
        if pilot.life.phase is Phase.FLYING:
            tilts_rad.append(float(np.hypot(*link.autopilot.true.euler_rad[:2, 0])))

    with Pilot(controller(), lambda: link, updates.append, watch) as pilot:
        pilot.take_off(1.0)
        assert pilot.life.delay_s == pytest.approx(0.11, abs=0.011)
        pilot.fly(Circle(0.5, 1.0), 5.0)
        pilot.land()
    assert horizontal_rms_m(updates) < 0.05
    assert max(tilts_rad) < 0.15


@pytest.mark.long
def test_a_link_whose_delay_varies_is_flown_as_one_with_their_mean() -> None:
    """20 to 80 ms and a fifth lost, in place of 50, mean of three draws: states are carried to one age.

    With states of the age at which they come the circle is half as far off again.
    """
    settings = settings_for(drone().with_sensors("autopilot"))

    def rms_m(faults: Faults, seed: int = 1) -> float:
        link, updates = WiredLink("ardupilot", drone(), seed=seed), list[Update]()
        link.wire.to_pilot = link.wire.to_autopilot = faults
        with Pilot(Controller(settings), lambda: link, updates.append) as pilot:
            pilot.take_off(1.0)
            pilot.fly(Circle(1.0, 1.5), 9.0)
            pilot.land()
        return horizontal_rms_m(updates, settled_s=4.0)

    varying = Faults(lost=0.2, delay_s=0.02, jitter_s=0.06)
    assert np.mean([rms_m(varying, seed) for seed in (1, 2, 3)]) < 1.2 * rms_m(Faults(delay_s=0.05))


@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
def test_a_take_over_in_wind_keeps_the_lean(stack: str, tmp_path: Path) -> None:
    """The autopilot leans by 10 degrees; the tilt moves by less than two, and the drone by less than 0.1 m.

    A controller that began upright would let it be blown 0.4 m away. Half a second later the estimated
    heading jumps by 34 degrees. The log, which has the drone without the lean, repeats the flight.
    """
    settings = settings_for(drone().with_sensors("autopilot"))
    link, updates, seen = WiredLink(stack, drone()), list[Update](), list[np.ndarray[Any, Any]]()

    def watch(pilot: Pilot) -> None:
        if pilot.life.phase is Phase.FLYING:
            true = link.autopilot.true
            seen.append(np.array([*true.position_m[:2, 0], *np.degrees(true.euler_rad[:2, 0])]))

    with Pilot(Controller(settings), lambda: link, updates.append, watch) as pilot:
        link.autopilot.blow((1.5, -1.0))
        pilot.take_off(4.0)
        place_m = pilot.state.position_m
        stay = Place(place_m).target
        pilot.follow(stay, 0.5)
        link.autopilot.reset_estimator(np.zeros(3), 0.6)
        pilot.follow(stay, 2.5)
        pilot.land()
    assert pilot.steering.frame.jumps == 1
    moved = np.abs(np.array(seen[:300]) - seen[0])
    assert np.hypot(*seen[0][2:]) > 9.0
    assert moved[:, :2].max() < 0.1
    assert moved[:, 2:].max() < 2.0
    write_log(updates, log := tmp_path / "flight.csv")
    replay = replay_log(log, {}, settings)
    np.testing.assert_array_equal(replay.replayed_rad, replay.logged_rad)


class Hovering:
    """A pilot that hovers at 1 m behind a wire, in a flight in which something happens."""

    def __init__(self, stack: str, condition: Condition | None = None) -> None:
        self.link, self.updates = WiredLink(stack, drone(), condition), list[Update]()
        self.autopilot = self.link.autopilot
        self.away_m: list[float] = []
        self._happens: list[tuple[float, Callable[[], None]]] = []
        self.pilot = Pilot(controller(), lambda: self.link, self.updates.append, self._watch)

    def _watch(self, pilot: Pilot) -> None:
        while self._happens and self.link.now_s() >= self._happens[0][0]:
            self._happens.pop(0)[1]()
        if pilot.life.phase is Phase.FLYING:
            self.away_m.append(float(np.linalg.norm(self.autopilot.true.position_m[:, 0] - START)))

    def fly(self, duration_s: float, *happens: tuple[float, Callable[[], None]]) -> None:
        """Take off, and hover for a time; let things happen at times since then."""
        with self.pilot:
            self.pilot.take_off(1.0)
            begun_s = self.link.now_s() + 1.0
            self._happens = [(begun_s + time_s, action) for time_s, action in happens]
            self.pilot.follow(lambda time_s: HERE, 1.0 + duration_s)  # noqa: ARG005 - it stays
            self.pilot.land()

    def wire(self, to_pilot: Faults, to_autopilot: Faults | None = None) -> Callable[[], None]:
        """Return what changes the faults of the wire."""

        def change() -> None:
            self.link.wire.to_pilot, self.link.wire.to_autopilot = to_pilot, to_autopilot or Faults()

        return change

    @property
    def sentence(self) -> str:
        """How it ended."""
        end = self.pilot.life.end
        assert end is not None
        return end.sentence


START = np.array(STARTS_M) - np.array([0.0, 0.0, 1.0])
HERE = TargetState([0.0, 0.0, -1.0], np.zeros(3), np.zeros(3))
LOST = Faults(lost=1.0)


@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
def test_estimates_lost_for_a_second_are_a_pause(stack: str) -> None:
    """Level set-points while none comes; then the controller begins anew where the drone is."""
    flight = Hovering(stack)
    flight.fly(
        3.0, (0.0, flight.autopilot.orders.clear), (0.0, flight.wire(LOST)), (1.0, flight.wire(Faults()))
    )
    assert flight.sentence == "landed: as planned"
    assert max(flight.away_m) < 0.25
    assert flight.pilot.steering.take_overs == 2
    sent = [order for order in flight.autopilot.orders if isinstance(order, SetAttitude)]
    last_s = max(one.estimate.time_s for one in flight.updates if one.take_overs == 1)
    level = [order for order in sent if last_s + 0.05 < order.time_s < last_s + 0.95]
    assert len(level) > 70
    assert not any(order.attitude_rad[:2].any() for order in level)


@pytest.mark.long
def test_px4_that_has_left_offboard_since_the_link_was_lost_lands() -> None:
    """It hovers in HOLD by its own failsafe: nobody has taken it, so the pilot lets it land."""
    flight = Hovering("px4")
    with pytest.raises(PilotError, match="landed: the link was silent, and PX4 has left OFFBOARD for HOLD"):
        flight.fly(4.0, (0.0, flight.wire(LOST, LOST)), (1.6, flight.wire(Faults())))
    assert not flight.autopilot.armed


@pytest.mark.long
def test_ardupilot_is_flown_on_after_a_link_lost_for_a_second() -> None:
    """It flies level by itself, and stays in GUIDED."""
    flight = Hovering("ardupilot")
    flight.fly(4.0, (0.0, flight.wire(LOST, LOST)), (1.0, flight.wire(Faults())))
    assert flight.sentence == "landed: as planned"
    assert max(flight.away_m) < 0.5


@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
def test_more_wind_than_the_controller_learns_lands_the_drone(stack: str) -> None:
    """After two seconds at its limit, with the words; a wind that it learns is flown, on target again."""
    calm = Hovering(stack)
    calm.fly(8.0, (0.0, lambda: calm.autopilot.blow((4.0, 0.0))))
    assert max(calm.away_m[-100:]) < 0.1
    stormy = Hovering(stack)
    most_m_s2 = stormy.pilot.steering.most_disturbance_m_s2
    why = rf"landed: pushed away: wind, .* with {most_m_s2:.1f} m/s\^2, all that the controller learns"
    with pytest.raises(PilotError, match=why):
        stormy.fly(8.0, (0.0, lambda: stormy.autopilot.blow((0.0, -1.5 * most_m_s2))))
    assert not stormy.autopilot.armed


def test_the_pilots_switch_takes_the_drone() -> None:
    """After the next heartbeat nothing is sent; the drone stays armed in its mode."""
    flight = Hovering("px4")

    def switch() -> None:
        flight.autopilot.mode = px4_mode(3)
        flight.autopilot.orders.clear()

    with pytest.raises(PilotError, match="changed from OFFBOARD to POSITION, by the pilot's switch"):
        flight.fly(3.0, (0.0, switch))
    assert flight.autopilot.armed
    assert flight.autopilot.mode == px4_mode(3)
    assert {type(order) for order in flight.autopilot.orders} <= {SetAttitude}


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
@pytest.mark.parametrize("heading_rad", [0.0, 2.0])
def test_a_jump_of_the_estimator_does_not_bump_the_drone(
    stack: str, heading_rad: float, tmp_path: Path
) -> None:
    """By 20 cm and 6 degrees: roll and pitch move by less than 0.7 degrees, and the drone glides there.

    The log has the jump, and its replay the bits of the flight.
    """
    flight = Hovering(stack, Condition(yaw_rad=heading_rad))
    settings = flight.pilot.steering.controller.settings
    flight.fly(9.0, (1.0, lambda: flight.autopilot.reset_estimator(np.array([0.16, -0.12, 0.0]), 0.11)))
    assert flight.pilot.steering.frame.jumps == 1
    jumped = np.array([one.jumps for one in flight.updates], bool)
    command_rad = np.array([one.command_rad for one in flight.updates])
    assert np.degrees(np.abs(command_rad[jumped] - command_rad[~jumped][-1]).max()) < 0.7
    write_log(flight.updates, log := tmp_path / "flight.csv")
    replay = replay_log(log, {}, settings)
    np.testing.assert_array_equal(replay.replayed_rad, replay.logged_rad)
    glided_m = flight.autopilot.true.position_m[:2, 0] - START[:2]
    np.testing.assert_allclose(glided_m, [-0.16, 0.12], atol=0.02)


@pytest.mark.long
def test_a_counted_jump_may_be_small_and_have_a_velocity() -> None:
    """The estimator was wrong by 0.1 m/s for a second: roll and pitch move by less than 4 degrees."""
    flight = Hovering("px4")

    def drift() -> None:
        flight.autopilot.drift_m_s = np.array([0.08, 0.06, 0.0])

    def reset() -> None:
        flight.autopilot.reset_estimator(-flight.autopilot.error_m)

    flight.fly(6.0, (0.0, drift), (1.0, reset))
    jumped = np.array([one.jumps for one in flight.updates], bool)
    command_rad = np.array([one.command_rad for one in flight.updates])
    assert flight.pilot.steering.frame.jumps == 1
    assert np.degrees(np.abs(command_rad[jumped] - command_rad[~jumped][-1]).max()) < 4.0
    np.testing.assert_allclose(flight.autopilot.true.position_m[:2, 0], START[:2], atol=0.03)


@pytest.mark.long
@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM")])
def test_ctrl_c_lands_and_raises(number: signal.Signals, word: str) -> None:
    """The program is told after the landing; SIGTERM, by which a service is stopped, does the same."""
    before, flight = signal.getsignal(number), Hovering("px4")
    with pytest.raises(KeyboardInterrupt, match=f"landed: {word}"):
        flight.fly(3.0, (0.0, lambda: os.kill(os.getpid(), number)))
    assert signal.getsignal(number) == before
    assert flight.autopilot.is_on_ground
    assert not flight.autopilot.armed


def test_ctrl_c_twice_stops_the_motors() -> None:
    """By force, in the air; it ends once the autopilot says that they stand."""
    flight = Hovering("px4")
    with pytest.raises(KeyboardInterrupt, match="Ctrl-C twice: the motors are stopped"):
        flight.fly(3.0, (0.0, interrupt), (0.3, interrupt))
    assert Arm(arm=False, force=True) in flight.autopilot.orders
    assert not flight.autopilot.armed


def interrupt() -> None:
    """Press Ctrl-C."""
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.long
@pytest.mark.parametrize("stack", BOTH)
def test_an_error_of_the_program_makes_the_drone_land(stack: str) -> None:
    """It is not hidden, and the drone lands first, though targets fail for good and a third is lost."""
    link = WiredLink(stack, drone(), seed=2)
    link.wire.to_pilot = link.wire.to_autopilot = Faults(lost=0.3, delay_s=0.025, jitter_s=0.03)

    def fail(time_s: float) -> TargetState:
        if time_s > 0.5:
            raise ValueError("a fault of the program")
        return HERE

    pilot = Pilot(controller(), lambda: link)

    def fly() -> None:
        with pilot:
            pilot.take_off(1.0)
            pilot.follow(fail, 3.0)

    with pytest.raises(ValueError, match="a fault of the program"):
        fly()
    assert pilot.life.end is not None
    assert pilot.life.end.sentence == "landed: the program has failed"
    assert not link.autopilot.armed


def fly_by_an_estimator(vehicle: VehicleFile) -> tuple[float, float]:
    """Fly settings for `vehicle` by an estimator that errs; return rms of command changes and errors."""
    link, updates, away_m = WiredLink("px4", SEEN, Condition(seed=5)), list[Update](), list[float]()

    def watch(pilot: Pilot) -> None:
        if pilot.life.phase is Phase.FLYING and len(updates) > 200:
            place_m = link.autopilot.true.position_m[:, 0] - STARTS_M
            away_m.append(float(np.linalg.norm((place_m - updates[-1].target.position_m)[:2])))

    with Pilot(controller(vehicle), lambda: link, updates.append, watch) as pilot:
        pilot.take_off(1.0)
        pilot.fly(Gerono(1.5, 0.6), 12.0)
        pilot.land()
    command_rad = np.array([one.command_rad for one in updates])[200:]
    changes = float(np.sqrt(np.mean(np.diff(command_rad, axis=0) ** 2)))
    return changes, float(np.sqrt(np.mean(np.square(away_m))))


SEEN = drone().with_sensors("autopilot")


@pytest.mark.long
def test_settings_for_the_estimator_of_an_autopilot_are_calm() -> None:
    """The command moves by a third less than without them, and the curve is no farther off."""
    (unknown, unknown_m), (known, known_m) = map(fly_by_an_estimator, (drone(), SEEN))
    assert known < 0.66 * unknown
    assert known_m < 1.1 * unknown_m


@pytest.mark.long
def test_the_log_shows_the_tilt_of_a_drone_whose_hover_thrust_is_wrong(tmp_path: Path) -> None:
    """By 20 %, as the thrust that the controller thinks it commands; a tilt accelerates the drone as ever."""
    pilot, _, updates = simulated("ardupilot", Condition(hover_thrust=0.5, believed=0.6))
    with pilot:
        pilot.take_off(1.0)
        pilot.fly(Gerono(1.5, 1.0), 16.0)
        pilot.land()
    write_log(updates, log := tmp_path / "flight.csv")
    motion = identify(read_logs([log], {})[0])[0].motion
    assert motion is not None
    assert motion.acceleration_per_tilt.value == pytest.approx(1.0, abs=0.03)
