"""The least IAE that a drone can have on quick curves, beside that of one flight.

A Crazyflie in still air, from rest at the beginning of the curve, 20 s. The bound knows the whole curve from
the first control step and has no noise: a convex problem over all commands, with the attitude model and drag
of the settings, the tilt limit along right and forward, and the largest thrust of level flight. Prints a
table in Markdown. Wants cvxpy with Clarabel.
"""

import math

import cvxpy
import numpy as np

from benchmarks.flights.fast import CASES, DRONE, DURATION_S, SENDERS, sent, settings
from benchmarks.markdown import table
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.reach import largest_acceleration_m_s2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of


def least_iae_m_s(chosen: Settings, path_m: FloatArray) -> float:
    """Return the least integral of the distance to path_m (k, 2), a point each control step, from rest."""
    steps, period_s = len(path_m) - 1, chosen.horizon.update_period_s
    height = chosen.height
    assert height is not None
    most = largest_acceleration_m_s2(chosen) * period_s**2
    by_thrust = math.sqrt(height.thrust_max_m_s2**2 - GRAVITY_M_S2**2) * period_s**2
    commands = [cvxpy.Variable((1, steps)) for _ in range(2)]
    rules, errors = [cvxpy.norm(cvxpy.vstack(commands), 2, axis=0) <= by_thrust], []
    for axis, command in enumerate(commands):
        transition, by_command = _motion(Quadratic(chosen), axis)
        state = cvxpy.Variable((len(transition), steps + 1))
        rules += [
            state[:, 0] == 0,
            state[:, 1:] == transition @ state[:, :-1] + by_command[:, None] @ command,
            cvxpy.abs(command) <= most,
        ]
        errors.append(state[0] - (path_m[:, axis] - path_m[0, axis]))
    distance = cvxpy.norm(cvxpy.vstack(errors), 2, axis=0)
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum(distance) * period_s), rules)
    found: float = problem.solve(solver=cvxpy.CLARABEL)
    return found


def _motion(method: Quadratic, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return the transition (5, 5) of p, v, a, i, c in a control step, and what a command adds (5,)."""
    attitude, drag = method.attitude, method.observer.drag_1_step
    rows = np.zeros((5, 6))
    rows[0] = 1, 1 - drag / 2, 0.5, 0, 0, 0
    rows[1] = 0, 1 - drag, 1, 0, 0, 0
    rows[2, 2:] = attitude.tilt_row[axis]
    rows[3, 2:] = attitude.integral_row[axis]
    rows[4, 4:] = attitude.lagged_row[axis]
    return rows[:, :5], rows[:, 5]


def main() -> None:
    """Print the table."""
    chosen = settings()
    rows = []
    for case in (one for one in CASES if one.slower == 1.0):
        flight = flight_of(
            [
                Scenario(
                    vehicle=DRONE,
                    trajectory=case.curve,
                    size_m=case.size_m,
                    rate_rad_s=case.rate_rad_s,
                    duration_s=DURATION_S,
                    sensors="mocap",
                )
            ],
            chosen.horizon.update_period_s,
        )
        rows.append(
            {
                "flight": case.words,
                "least possible": f"{least_iae_m_s(chosen, _path_m(flight)):.3f}",
                **{one.words: f"{_flown(chosen, flight, one.known):.3f}" for one in SENDERS},
            }
        )
    print(table(rows), flush=True)


def _path_m(flight: Flight) -> FloatArray:
    """Return the path (k, 2) of a flight's targets."""
    path: FloatArray = flight.targets_in_space[:, 0, :2]
    return path


def _flown(chosen: Settings, flight: Flight, known: int) -> float:
    """Return the IAE of one flight whose program knows this much, in m s."""
    trace = fly(sent(flight, known), CompiledController(chosen, 1))
    return float(measure(trace).iae_m_s[0])


if __name__ == "__main__":
    main()
