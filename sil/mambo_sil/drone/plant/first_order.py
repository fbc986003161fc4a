"""A drone of whose code nothing is known: gain, lag and dead time of each angle, as a log shows them.

The commands run its equal in C, `flight/engine/first_order.h`, which has the same bits.

    angle(t) follows gain x command(t - dead time) with a first-order lag, yaw its reference
    horizontal acceleration = k x that of the thrust at these angles less their trims - drag (v - air) + push
    vertical acceleration = g - that of the thrust

with k the acceleration per tilt: the angles are those that the drone reports, and its thrust need not point
along them. The thrust is the demanded one, or follows gain x demand(t - dead time) with a first-order lag.
Angles and thrust are solved in closed form, the motion is integrated.
"""

import math
from dataclasses import dataclass

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential, sine_cosine
from mambo_sil.drone.plant.integrator import NODES, bogacki_shampine
from mambo_sil.drone.plant.rigid_body import EULER, POSITION, RATES, VELOCITY, to_body, to_world
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude, Response, ThrustResponse


@dataclass(frozen=True, eq=False)
class Decay:
    """How an angle or a thrust follows its command within a tick; the command that acts changes once in it.

    `late_ticks` is the number of whole ticks in the dead time; the command before acts in the rest of it.
    `before` and `after` are the shares of the error that remain while each of the two acts, at the second and
    third node of the integrator and at the end of the tick (3,).
    """

    late_ticks: int
    before: FloatArray
    after: FloatArray


def decay_of(response: Response | ThrustResponse, step_s: float) -> Decay:
    """Return how an angle or a thrust with this response follows its command."""
    late_ticks = math.floor(response.dead_time_s / step_s + 1e-9)
    rest_s = max(response.dead_time_s - late_ticks * step_s, 0.0)
    nodes_s = step_s * np.append(NODES[1:], 1.0)
    before = exponential(-np.minimum(nodes_s, rest_s) / response.lag_s)
    after = exponential(-np.maximum(nodes_s - rest_s, 0.0) / response.lag_s)
    return Decay(late_ticks, before, after)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Demanded thrust and forces on n drones during one tick, each one value or (n,)."""

    demand_n: FloatArray
    """Demanded thrust (n,), not negative: rotors do not pull down."""
    thrust_share: PerFlight
    """Thrust over the thrust of a nominal drone with a fresh battery."""
    mass_kg: PerFlight
    drag_1_s: PerFlight
    push_m_s2: tuple[PerFlight, PerFlight]
    air_m_s: tuple[PerFlight, PerFlight]
    lift_m_s2: PerFlight


class FirstOrderDrone:
    """The drone as a whole.

    Its memory is the commands of the last ticks, the latest first, in pairs; then, with a response of the
    thrust, the thrust and its demands in N, the latest first.
    """

    def __init__(self, drone: VehicleFile, attitude: FirstOrderAttitude) -> None:
        self._step_s, self._attitude = drone.step_s, attitude
        self._responses = attitude.roll, attitude.pitch
        self._trim_rad = np.array([[attitude.roll_trim_rad], [attitude.pitch_trim_rad], [0.0]])
        self.decays = tuple(decay_of(response, drone.step_s) for response in self._responses)
        nodes_s = drone.step_s * np.append(NODES[1:], 1.0)
        self.yaw_decay = exponential(-nodes_s / attitude.yaw_lag_s)
        self._commands = 2 * (max(decay.late_ticks for decay in self.decays) + 2)
        self._thrust = drone.thrust
        self.thrust_decay = None if drone.thrust is None else decay_of(drone.thrust, drone.step_s)
        self.rows = self._commands + (0 if self.thrust_decay is None else self.thrust_decay.late_ticks + 3)

    def at_rest(self, demand_n: FloatArray) -> FloatArray:
        """Return the memory (rows, n) of drones that were level, with a steady demand (n,) of thrust."""
        memory = np.zeros((self.rows, len(demand_n)))
        if self._thrust is not None:
            memory[self._commands :] = demand_n
            memory[self._commands] = self._thrust.gain * demand_n
        return memory

    def advance(
        self,
        body: FloatArray,
        memory: FloatArray,
        command_rad: FloatArray,
        yaw_reference_rad: PerFlight,
        around: Surroundings,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the state (12, n), with the rows of the rigid body, and the memory one tick later."""
        commands = np.concatenate([command_rad, memory[: self._commands - 2]])
        nodes, slopes = self._angles(body[EULER], commands, yaw_reference_rad)
        thrusts_n, thrust_memory = self._thrusts(around.demand_n, memory[self._commands :])
        forced = [
            self._acceleration(angles, thrust, around)
            for angles, thrust in zip((body[EULER], *nodes[:2]), thrusts_n, strict=True)
        ]

        def derivative(motion: FloatArray, acceleration: FloatArray) -> FloatArray:
            rate = np.empty_like(motion)
            rate[:3] = motion[3:]
            for axis in range(2):
                drag = around.drag_1_s * (motion[3 + axis] - around.air_m_s[axis])
                rate[3 + axis] = acceleration[axis] - drag
            rate[5] = acceleration[2]
            return rate

        sines, cosines = sine_cosine(body[EULER])
        motion = np.concatenate([body[POSITION], to_world(sines, cosines, body[VELOCITY])])
        motion = bogacki_shampine(derivative, motion, (forced[0], forced[1], forced[2]), self._step_s)
        after = np.empty_like(body)
        after[POSITION] = motion[:3]
        after[EULER] = nodes[2]
        after[VELOCITY] = to_body(nodes[2], motion[3:])
        after[RATES] = _body_rates(nodes[2], slopes)
        return after, np.concatenate([commands, thrust_memory])

    def _thrusts(
        self, demand_n: FloatArray, memory: FloatArray
    ) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
        """Return the thrusts (n,) in N at the nodes, and the thrust's part of the memory one tick later."""
        if self._thrust is None or self.thrust_decay is None:
            return (demand_n, demand_n, demand_n), memory
        decay, demands = self.thrust_decay, np.concatenate([demand_n[np.newaxis], memory[1:-1]])
        now, before = (self._thrust.gain * demands[decay.late_ticks + ticks] for ticks in (0, 1))
        nodes = []
        for node in range(3):
            reached = before + (memory[0] - before) * decay.before[node]
            nodes.append(now + (reached - now) * decay.after[node])
        return (memory[0], nodes[0], nodes[1]), np.concatenate([nodes[2][np.newaxis], demands])

    def _angles(
        self, start_rad: FloatArray, memory: FloatArray, yaw_reference_rad: PerFlight
    ) -> tuple[list[FloatArray], FloatArray]:
        """Return the angles (3, n) at the later nodes and the end, and their rates of change (3, n) there."""
        nodes = [np.empty_like(start_rad) for _ in range(3)]
        slopes = np.empty_like(start_rad)
        for axis, (response, decay) in enumerate(zip(self._responses, self.decays, strict=True)):
            newest = 2 * decay.late_ticks + axis
            now, before = response.gain * memory[newest], response.gain * memory[newest + 2]
            for node, angles in enumerate(nodes):
                turned = before + (start_rad[axis] - before) * decay.before[node]
                angles[axis] = now + (turned - now) * decay.after[node]
            slopes[axis] = (now - nodes[2][axis]) / response.lag_s
        for node, angles in enumerate(nodes):
            angles[2] = yaw_reference_rad + (start_rad[2] - yaw_reference_rad) * self.yaw_decay[node]
        slopes[2] = (yaw_reference_rad - nodes[2][2]) / self._attitude.yaw_lag_s
        return nodes, slopes

    def _acceleration(self, angles_rad: FloatArray, thrust_n: FloatArray, around: Surroundings) -> FloatArray:
        """Return the acceleration (3, n) in the world by thrust (n,), push, gravity and lift."""
        thrust = np.zeros_like(angles_rad)
        thrust[2] = -(around.thrust_share * thrust_n / around.mass_kg)
        acceleration = to_world(*sine_cosine(angles_rad - self._trim_rad), thrust)
        for axis in range(2):
            acceleration[axis] = (
                self._attitude.acceleration_per_tilt_g * acceleration[axis] + around.push_m_s2[axis]
            )
        acceleration[2] = acceleration[2] + (GRAVITY_M_S2 - around.lift_m_s2)
        return acceleration


def _body_rates(angles_rad: FloatArray, slopes_rad_s: FloatArray) -> FloatArray:
    """Return the body rates (3, n) of drones whose angles change at these rates: eqs 4, 5 solved for them."""
    (sin_roll, sin_pitch, _), (cos_roll, cos_pitch, _) = sine_cosine(angles_rad)
    roll, pitch, yaw = slopes_rad_s
    rates = np.empty_like(angles_rad)
    rates[0] = roll - sin_pitch * yaw
    rates[1] = cos_roll * pitch + sin_roll * (cos_pitch * yaw)
    rates[2] = cos_roll * (cos_pitch * yaw) - sin_roll * pitch
    return rates
