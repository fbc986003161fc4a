"""The life of a flight: connect, check, arm, climb, fly, land; without a socket and without a clock.

Give it what comes (`receive`), and send what it wants (`orders`), both with the present time. Every way in
which it can end is a `FlightEnd` with a sentence.
"""

import math
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.life.checks import Preflight, stack_of
from mambo_sil.life.courses import Place, TargetCourse
from mambo_sil.life.estimates import Estimates
from mambo_sil.life.phases import FlightEnd, Phase, Timer
from mambo_sil.life.records import (
    COMPANION,
    SET_MODE,
    Answer,
    Arm,
    Beat,
    EstimatedState,
    Heartbeat,
    OnGround,
    Order,
    Record,
    SetMode,
    SetPosition,
    Stack,
    TakeOff,
    Text,
)
from mambo_sil.life.steering import PAUSE_S, Steering

CONNECT_S, CHECK_S, ARM_S, LAND_S, STOP_S = 10.0, 8.0, 15.0, 60.0, 10.0
"""How long each phase may last before the pilot gives up; climb and landing: longer, by the height."""
STILL_M_S: Final = 0.2
"""A drone that is slower stands on the ground, or hovers: nobody may stop its motors unseen."""
SLOWEST_M_S: Final = 0.5
REACHED_M, RESTS_S = 0.3, 2.0
"""When the climb is over: as near to the height, for as long."""
LOST_S: Final = 2.0
"""Time without an estimate after which the pilot lands, and without any message after which it ends."""
REFUSED_S: Final = 0.5
"""How long the controller may refuse the state before the pilot lands."""
PUSHED_S: Final = 2.0
"""How long the drone may be pushed with all that the controller learns before the pilot lands."""
ASK_S, BEAT_S, PING_S = 0.5, 1.0, 0.02
"""Periods of repeated requests, of heartbeats, and of what measures the delay of the link."""
FARTHEST_M: Final = 20.0
"""Distance from the drone to its target beyond which the pilot lands, unless it is given another."""
STOPS_S: Final = 0.05
"""Period in which the motors are told to stop."""
ARM_PASSES_S: Final = 2.0
"""Time in which an order to arm may be on its way: a drone that is disarmed until then may be armed by it."""
SILENT_S, FAILSAFE_S = 0.5, 5.0
"""A silence after which the autopilot may act by its failsafe, and how long after it that is seen."""


_LONGEST: Final = {Phase.CONNECTING: CONNECT_S, Phase.CHECKING: CHECK_S, Phase.ARMING: ARM_S}
_IN_FLIGHT: Final = (Phase.ARMING, Phase.CLIMBING, Phase.FLYING, Phase.LANDING)
_WITH_ESTIMATES: Final = (Phase.ARMING, Phase.CLIMBING, Phase.FLYING)


class LifeCycle:
    """One flight; `steering` flies it once it is at `height_m` above the ground.

    It lands where the target is farther than `farthest_m` from the drone.
    """

    def __init__(self, steering: Steering, height_m: float, farthest_m: float = FARTHEST_M) -> None:
        self.steering, self.height_m, self.farthest_m = steering, height_m, farthest_m
        self.phase = Phase.CONNECTING
        self.end: FlightEnd | None = None
        self.hint = ""
        """Why no heartbeat may be heard, as the link knows it."""
        self.stack: Stack | None = None
        self.system = 0
        self.delay_s = math.nan
        """The delay of the link in each direction, as measured before the flight."""
        self.estimates = Estimates()
        self.course: TargetCourse = Place(np.zeros(3))
        self.course_time_s = 0.0
        """Time on the clock of the course, which stands still while there is no estimate."""
        self._begun_s: float | None = None
        self._preflight: Preflight | None = None
        self._landed, self._armed, self._mode = False, False, -1
        self._lands = False
        """Whether the autopilot has accepted to land."""
        self._place_m = np.zeros(3)
        self._why, self._good = "", True
        self._last_text = ""
        self._believes = True
        """Whether the drone may still be flown by the estimates."""
        self._believed: EstimatedState | None = None
        """The newest estimate by which it may be flown."""
        self._arm_s = self._silence_s = -math.inf
        """When the autopilot was last told to arm, and when the last silence ended."""
        self._was_armed = self._obeyed = self._is_failsafe = False
        """Whether it was armed since then, was in a mode that it was told, and has left that by itself."""
        self._stepped_s = -math.inf
        self._now_s = self._message_s = self._rest_s = self._accepted_s = 0.0
        self._land_s = LAND_S
        self._beat, self._ask, self._level = Timer(BEAT_S), Timer(ASK_S), Timer(0.0)
        self._ping = Timer(PING_S)
        self._arm, self._changes_mode, self._stop = Timer(BEAT_S), Timer(BEAT_S), Timer(STOPS_S)

    # What the pilot is told to do.

    def fly(self, course: TargetCourse) -> None:
        """Fly a course from now on."""
        self.course, self.course_time_s = course, 0.0

    @property
    def estimate(self) -> EstimatedState | None:
        """The newest estimate."""
        return self.estimates.newest

    @property
    def is_over(self) -> bool:
        """Whether the flight has ended."""
        return self.end is not None

    @property
    def is_flying(self) -> bool:
        """Whether the motors may turn."""
        return self.phase in _IN_FLIGHT or self.phase is Phase.STOPPING

    @property
    def is_course_over(self) -> bool:
        """Whether the clock of the course is at its end."""
        return self.course_time_s >= self.course.duration_s

    def land(self, why: str, *, good: bool) -> None:
        """Land because of `why`; what was not told to arm ends at once."""
        is_idle = self.phase is Phase.ARMING and not self._armed and self._arm_s == -math.inf
        if is_idle or self.phase in (Phase.CONNECTING, Phase.CHECKING):
            self._finish(f"no flight: {why}", good=False)
        elif self.phase in _IN_FLIGHT and self.phase is not Phase.LANDING:
            if self._believed is not None:
                height_m = float(self._place_m[2] - self._believed.position_m[2])
                self._land_s = LAND_S + max(height_m, 0.0) / SLOWEST_M_S
            if self.phase is not Phase.FLYING:
                self.hold()
            self._enter(Phase.LANDING)
            self._why, self._good = why, good

    def hold(self) -> None:
        """Leave the course, and stay where the drone is, or was when its estimates were last believed."""
        if self._believed is not None:
            self.course = Place(self._believed.position_m)

    def stop(self, why: str) -> None:
        """Stop the motors at once, wherever the drone is."""
        if self.phase in _IN_FLIGHT:
            self._enter(Phase.STOPPING)
            self._why = why
        elif self.phase in (Phase.CONNECTING, Phase.CHECKING):
            self._finish(f"no flight: {why}", good=False)

    # What comes.

    def receive(self, record: Record, now_s: float) -> None:
        """Take a record that has come."""
        if self.phase is Phase.ENDED:
            return
        self._now_s = now_s
        if now_s - self._message_s > SILENT_S:
            self._silence_s = now_s
        self._message_s = now_s
        if self._preflight is not None and self.phase is Phase.CHECKING:
            self._preflight.receive(record, now_s)
        match record:
            case Heartbeat():
                self._receive_heartbeat(record, now_s)
            case EstimatedState():
                self._receive_estimate(record, now_s)
            case Answer() if record.command == SET_MODE and self.phase is Phase.LANDING:
                self._lands |= record.accepted
            case OnGround():
                self._landed = record.landed
            case Text():
                self._last_text = record.text

    def _receive_heartbeat(self, beat: Heartbeat, now_s: float) -> None:
        if beat.vehicle == COMPANION:
            self._meet_pilot(beat)
        elif self.stack is None:
            found = stack_of(beat)
            if isinstance(found, str):
                self._finish(f"no flight: {found}", good=False)
            else:
                self.stack, self.system = found, beat.system
                self._preflight = Preflight(found, self.steering.controller.update_period_s)
                self._enter(Phase.CHECKING)
        else:
            self._armed, self._mode = beat.armed, beat.mode
            if self.is_flying:
                self._was_armed |= beat.armed
                self._obeyed |= beat.mode in {self.stack.guided, self.stack.land}
                self._check_control(self.stack, now_s)

    def _meet_pilot(self, beat: Heartbeat) -> None:
        """Leave the drone to one pilot: two would send set-points in turn."""
        who = f"another pilot is on the link (system {beat.system}, component {beat.component})"
        if self.phase in (Phase.CONNECTING, Phase.CHECKING):
            self._finish(f"no flight: {who}; end it first", good=False)
        else:
            self.land(who, good=False)

    def _check_control(self, stack: Stack, now_s: float) -> None:
        """End the flight if the drone is not armed any more, or somebody else has taken it."""
        if self.phase is Phase.ARMING:
            return
        if not self._armed:
            if now_s - self._arm_s > ARM_PASSES_S:
                self._finish_disarmed(stack)
        elif self._obeyed and self.phase is not Phase.STOPPING:
            self._check_mode(stack, now_s)

    def _finish_disarmed(self, stack: Stack) -> None:
        """End the flight of a drone that is disarmed."""
        if self.phase is Phase.LANDING:
            end = "landed" if self._was_armed else "no flight"
            self._finish(f"{end}: {self._why}", good=self._good and self._was_armed)
        elif self.phase is Phase.STOPPING:
            self._finish(f"{self._why}: the motors are stopped", good=False)
        else:
            why = f", which says: {self._last_text}" if self._last_text else ""
            self._finish(f"{stack.name} has stopped the motors in flight{why}", good=False)

    def _finish_armed(self, told: str, now_s: float) -> None:
        """End the flight of a drone of which nobody knows that it is disarmed."""
        newest = self.estimates.newest if now_s - self.estimates.fresh_s < LOST_S else None
        speed_m_s = math.inf if newest is None else float(np.linalg.norm(newest.velocity_m_s))
        still = ""
        if speed_m_s < STILL_M_S:
            still = "; it does not move: if it stands on the ground, stop its motors by your transmitter"
        told = f"{told}, and has not confirmed that it is disarmed{still}"
        self._finish(f"NOT DISARMED: {told} (ended: {self._why})", good=False)

    def _check_mode(self, stack: Stack, now_s: float) -> None:
        """Leave the drone to who has changed its mode; land it if that was its failsafe after a silence."""
        if self._mode == stack.guided or (self._mode == stack.land and self.phase is Phase.LANDING):
            return
        mode, wanted = stack.modes.get(self._mode, f"mode {self._mode}"), stack.modes[stack.guided]
        self._is_failsafe |= now_s - self._silence_s < FAILSAFE_S
        if self._mode == stack.hold and self._is_failsafe:
            self.land(f"the link was silent, and {stack.name} has left {wanted} for {mode}", good=False)
        else:
            self._finish(
                f"{stack.name} has changed from {wanted} to {mode}, by the pilot's switch or a failsafe: "
                "nothing is sent any more",
                good=False,
            )

    def _receive_estimate(self, estimate: EstimatedState, now_s: float) -> None:
        """Keep an estimate; land by the autopilot's own controller if it cannot be believed."""
        self.estimates.receive(estimate, now_s, in_flight=self.is_flying)
        doubt = self.estimates.doubt
        if doubt is not None and self.phase in (Phase.CLIMBING, Phase.FLYING):
            self._believes = False
            self.land(f"{doubt}; somebody else may send with its system number", good=False)
        elif self._believes:
            self._believed = self.estimate

    # What is sent.

    def orders(self, now_s: float) -> list[Order]:
        """Return what to send now."""
        self._now_s = now_s
        if self._begun_s is None:
            self._begun_s = self._message_s = self.estimates.fresh_s = now_s
            self._level = Timer(self.steering.controller.update_period_s)
        if self.phase is Phase.ENDED:
            return []
        self._give_up(now_s)
        orders: list[Order] = [Beat()] if self._beat.is_due(now_s) else []
        match self.phase:
            case Phase.CHECKING:
                orders += self._check(now_s)
            case Phase.ARMING:
                orders += self._start(now_s)
            case Phase.CLIMBING:
                orders += self._climb(now_s)
            case Phase.FLYING:
                orders += self._steer(now_s)
            case Phase.LANDING:
                orders += self._land(now_s)
            case Phase.STOPPING if self._stop.is_due(now_s):
                orders.append(Arm(arm=False, force=True))
        return orders

    def _give_up(self, now_s: float) -> None:
        """End what has lasted too long."""
        if self._begun_s is None:
            return
        passed_s, silent_s = now_s - self._begun_s, now_s - self._message_s
        name = "the autopilot" if self.stack is None else self.stack.name
        if self.phase is Phase.LANDING and silent_s > LOST_S + CONNECT_S:
            told = f"{name} was told to land for {passed_s:.0f} s, which it has not confirmed"
            self._finish(f"the link is lost: {told}; it acts by its own failsafe", good=False)
        elif self.phase is Phase.LANDING and passed_s > self._land_s:
            self._finish_armed(f"{name} was told to land for {passed_s:.0f} s", now_s)
        elif self.phase is Phase.STOPPING and passed_s > STOP_S:
            self._finish_armed(f"{name} was told to stop the motors for {passed_s:.0f} s", now_s)
        elif self.phase in _WITH_ESTIMATES and now_s - self.estimates.fresh_s > LOST_S:
            what = "message" if silent_s > LOST_S else "estimate that is not late"
            self.land(f"no {what} has come for {LOST_S:g} s", good=False)
        elif self.phase in _LONGEST and passed_s > _LONGEST[self.phase]:
            self._end_early(name)
        elif self.phase is Phase.CLIMBING and passed_s > ARM_S + self.height_m / SLOWEST_M_S:
            self.land(f"{self.height_m:g} m were not reached within {passed_s:.0f} s", good=False)

    def _end_early(self, name: str) -> None:
        """End before the flight, and say what is missing; land if the drone may be armed."""
        says = f", and says: {self._last_text}" if self._last_text else ""
        if self.phase is Phase.CONNECTING:
            waited = f"no heartbeat has come within {CONNECT_S:.0f} s"
            why = f"{waited}: start the autopilot, and let it send to this port{self.hint}"
        elif self.phase is Phase.CHECKING and self._preflight is not None:
            why = f"{self._preflight.missing()}{says}"
        else:
            why = f"{name} did not arm within {ARM_S:.0f} s{says}"
        self.land(why, good=False)

    def _check(self, now_s: float) -> list[Order]:
        """Ask for what is missing; go on once all is there and good."""
        preflight, estimate = self._preflight, self.estimate
        if preflight is None:
            return []
        if preflight.missing() is not None or estimate is None:
            pings = [preflight.ping(now_s)] if self._ping.is_due(now_s) else []
            return pings + (preflight.requests() if self._ask.is_due(now_s) else [])
        if fault := preflight.fault():
            self._finish(f"no flight: {fault}", good=False)
        else:
            self._place_m = estimate.position_m
            self.delay_s = self.steering.prediction.delay_s = preflight.delay_s
            self.steering.hover_thrust = self.steering.mean_thrust = preflight.hover_thrust
            self._enter(Phase.ARMING)
        return []

    def _start(self, now_s: float) -> list[Order]:
        """Change to the guided mode, and arm."""
        stack = self.stack
        if stack is None or self._begun_s is None:
            return []
        orders = self._hover_above()
        if self._armed and self._mode == stack.guided:
            self._enter(Phase.CLIMBING)
            return orders
        if now_s - self._begun_s >= stack.obeys_after_s:
            if self._mode != stack.guided:
                orders += [SetMode(stack.guided)] if self._changes_mode.is_due(now_s) else []
            if self._mode == stack.guided or stack.climbs_by_set_points:
                orders += self._tell_to_arm(now_s)
        return orders

    def _tell_to_arm(self, now_s: float) -> list[Order]:
        """Return the order to arm, once a period; from the first one on the drone may be armed."""
        if not self._arm.is_due(now_s):
            return []
        self._arm_s = now_s
        return [Arm(arm=True)]

    def _hover_above(self) -> list[Order]:
        """Return the set-point above the place of take-off, of an autopilot that climbs by set-points."""
        return self._hover_at(self._place_m - np.array([0.0, 0.0, self.height_m]))

    def _hover_at(self, position_m: FloatArray) -> list[Order]:
        """Return the set-point of a place (3,), of an autopilot that climbs by set-points."""
        estimate, believed = self.estimates.take(), self._believed
        if self.stack is None or estimate is None or believed is None or not self.stack.climbs_by_set_points:
            return []
        return [SetPosition(estimate.time_s, position_m, float(believed.attitude_rad[2]))]

    def _climb(self, now_s: float) -> list[Order]:
        """Let the autopilot climb; take over once it is up and at rest."""
        estimate = self.estimate
        if self.stack is None or estimate is None:
            return []
        self.steering.lean.watch(estimate)
        away_m = abs(float(estimate.position_m[2] - self._place_m[2]) + self.height_m)
        if away_m > REACHED_M:
            self._rest_s = now_s
        if now_s - self._rest_s > RESTS_S:
            self._enter(Phase.FLYING)
            above_m = self._place_m - np.array([0.0, 0.0, self.height_m])
            self.fly(Place(above_m))
            return self._steer(now_s)
        orders = self._hover_above()
        if not self.stack.climbs_by_set_points and away_m > REACHED_M and self._ask.is_due(now_s):
            orders.append(TakeOff(self.height_m))
        return orders

    def _steer(self, now_s: float) -> list[Order]:
        """Return the controller's set-point, once a period, or a level one where no fresh estimate comes."""
        fresh_s, estimate = self.estimates.fresh_s, self.estimates.carried(now_s)
        if estimate is not None and self._believes and now_s - fresh_s <= PAUSE_S:
            return self._step(estimate, now_s) if self.steering.is_due(estimate) else []
        if self.estimate is None or not self._level.is_due(now_s):
            return []
        return [self.steering.level(self.estimate.time_s + now_s - fresh_s)]

    def _step(self, estimate: EstimatedState, now_s: float) -> list[Order]:
        """Step the controller; land if it refuses the state for long, or the target is too far."""
        last_s, self._stepped_s = self._stepped_s, estimate.time_s
        passed_s = estimate.time_s - last_s
        self.course_time_s += passed_s if passed_s <= PAUSE_S else 0.0
        set_point = self.steering.steer(
            estimate, lambda ago_s: self.course.target(max(self.course_time_s - ago_s, 0.0))
        )
        away_m = self.steering.away_m
        if not self.steering.is_accepted:
            if self.phase is Phase.FLYING and now_s - self._accepted_s > REFUSED_S:
                self.land("the controller refuses the state, which is out of its [ranges]", good=False)
            return [set_point]
        self._accepted_s = now_s
        if self.phase is Phase.FLYING and self.steering.pushed_s > PUSHED_S:
            most_m_s2 = self.steering.most_disturbance_m_s2
            why = f"wind, or a drone that the settings do not describe, pushes it with {most_m_s2:.1f} m/s^2"
            all_of_it = "all that the controller learns (observer.disturbance_limit_m_s2)"
            self.land(f"pushed away: {why}, {all_of_it}", good=False)
        elif self.phase is Phase.FLYING and self.steering.swings.are_there:
            why = "the drone swings between its limits of tilt: settings too quick for this link or drone"
            self.land(f"{why}; design --sensors autopilot writes calmer ones", good=False)
        elif self.phase is Phase.FLYING and away_m > self.farthest_m:
            self.hold()
            self.land(f"the target is {away_m:.0f} m away; farthest_m = {self.farthest_m:g}", good=False)
        return [set_point]

    def _land(self, now_s: float) -> list[Order]:
        """Let the autopilot land, and disarm on the ground; fly on, or stay, until it has changed its mode.

        Without set-points PX4 would leave its guided mode, as at a switch of the human pilot.
        """
        stack = self.stack
        if stack is None:
            return []
        orders: list[Order] = []
        if self._mode != stack.land:
            orders += [SetMode(stack.land)] if self._changes_mode.is_due(now_s) else []
            if self.steering.take_overs and not self._lands:
                orders += self._steer(now_s)
            elif not self.steering.take_overs:
                orders += self._hover_at(self.course.target(0.0).position_m)
        if self._landed and self._arm.is_due(now_s):
            orders.append(Arm(arm=False))
        return orders

    def _enter(self, phase: Phase) -> None:
        """Begin a phase."""
        self.phase, self._begun_s = phase, self._now_s
        self._rest_s = self._accepted_s = self._now_s
        self._ask, self._arm, self._changes_mode = Timer(ASK_S), Timer(BEAT_S), Timer(BEAT_S)

    def _finish(self, sentence: str, *, good: bool) -> None:
        self.phase, self.end = Phase.ENDED, FlightEnd(sentence, good)
