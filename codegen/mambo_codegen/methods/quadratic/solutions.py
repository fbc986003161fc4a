"""Solve the equations of law, attitude model and observer to 40 digits; results are rounded to float64 once.

`keep` keeps the results, so this module, which imports mpmath, is imported only where one is missing.
"""

import math
from typing import Any, Final

from mambo_codegen.methods.quadratic.riccati import Matrix, feedback_gain, hold, mp, solve_riccati, sum_costs

Rows = list[list[float]]
LoopValues = tuple[float, float, float, float]
"""The arguments of `_Loop`."""

_INNER: Final = (3, 4, 5)
_COMMAND: Final = 6
_MOVED: Final = (0, 1, *_INNER, _COMMAND)
"""Indices of the attitude loop's states, of the command and of `MOVED` among `law.STATES` less the jerk."""
_JERK: Final = 3
"""Index of the jerk in a row."""
SECOND_SHARE: Final = 1 / 3
"""The second free move looks ahead by so much of the ramp beyond the first."""
_DISTURBANCE_POLE_1_S: Final = "0.001"
_LEAK_1_S: Final = "0.001"
"""The integral part decays at this rate, so that a loop that never answers has a bounded model."""

_MOST_SNAP_S: Final = 1
"""Of what a move takes of the derivative of the target's jerk, over what it takes of the jerk."""

_SETTLING: Final = 42
"""Lags after which what decays with at least half their rate is below 1e-9."""


class _Loop:
    """An attitude loop, in seconds, with 40 digits; arguments as of `AttitudeLoop`."""

    def __init__(self, lag_s: float, feedback_s: float, delay_s: float, integral_1_s: float) -> None:
        self.lag_s = mp.mpf(lag_s) - mp.mpf(feedback_s)
        self.delay_s = mp.mpf(delay_s)
        self.integral_1_s = mp.mpf(integral_1_s)

    def rates(self, period_s: Any) -> tuple[Matrix, Matrix]:
        """Return the rates (3, 3) of [a, i / integral, c] and of the command (3, 1), in 1/s.

        Without a delay a follows the command itself, and c, which nothing reads, follows within a period.
        """
        prompt = self.delay_s == 0
        follow = 1 / (period_s if prompt else self.delay_s)
        a, c, u = 1 / self.lag_s, mp.mpf(0) if prompt else 1 / self.lag_s, 1 / self.lag_s
        return (
            mp.matrix([[-a, self.integral_1_s * a, c], [-1, -mp.mpf(_LEAK_1_S), 0], [0, 0, -follow]]),
            mp.matrix([[u if prompt else 0], [1], [follow]]),
        )


def solve_law(
    update_period_s: float,
    ramp_s: float,
    response_time_s: float,
    velocity_weight_s: float,
    loop: LoopValues,
) -> dict[str, Any]:
    """Return the members of the `LawSolution` of an axis whose attitude loop is `loop`."""
    law = _Law(mp.mpf(update_period_s), response_time_s, velocity_weight_s, _Loop(*loop))
    ramp = round(ramp_s / update_period_s)
    rows, curvature = law.two_moves(ramp) if ramp else (law.one_move(), None)
    jerks, snap_s = law.following(rows, mp.mpf(SECOND_SHARE * ramp_s))
    scaled = [
        [float(rows[move, k] * scale) for k, scale in enumerate(law.scale())] for move in range(rows.rows)
    ]
    return {
        "rows": [
            [*row[:_JERK], float(jerk / law.period_s), *row[_JERK:]]
            for row, jerk in zip(scaled, jerks, strict=True)
        ],
        "snap_s": snap_s,
        "ratio": 0.0 if curvature is None else float(curvature[0, 1] / curvature[0, 0]),
        "curvature": None if curvature is None else _floats(curvature),
        "closed_loop": _floats(law.closed_loop(rows)),
    }


class _Law:
    """The law along one axis."""

    def __init__(self, period_s: Any, response_time_s: float, velocity_weight_s: float, loop: _Loop) -> None:
        self.period_s, self._loop = period_s, loop
        self._transition, self._input = _model(loop, period_s)
        self._state_cost = mp.zeros(7)
        self._state_cost[0, 0] = mp.mpf(1)
        self._state_cost[1, 1] = mp.mpf(velocity_weight_s) ** 2
        self._input_cost = mp.matrix([[(mp.mpf(response_time_s) ** 3 / period_s) ** 2]])
        self._to_go = solve_riccati(self._transition, self._input, self._state_cost, self._input_cost)

    def one_move(self) -> Matrix:
        """Return the row of the one free move, in SI units."""
        rows = -feedback_gain(self._transition, self._input, self._input_cost, self._to_go)
        rows[0, _COMMAND] += 1
        return rows

    def two_moves(self, ramp: int) -> tuple[Matrix, Matrix]:
        """Return the rows of both free moves, in SI units, and the second derivatives of the cost by them.

        Sums the cost over both moves as a quadratic form of state and moves, and minimises it.
        """
        form = mp.zeros(9)
        form[:7, :7] = self._to_go
        first, second = mp.zeros(1, 9), mp.zeros(1, 9)
        first[7], first[_COMMAND] = mp.mpf(1), mp.mpf(-1)
        second[8], second[7] = mp.mpf(1) / ramp, mp.mpf(-1) / ramp
        for change, steps in ((second, ramp), (first, 1)):
            transition, cost = mp.eye(9), mp.zeros(9)
            transition[:7, :7] = self._transition
            transition[:7, :] += self._input * change
            cost[:7, :7] = self._state_cost
            cost += self._input_cost[0] * (change.T * change)
            form = sum_costs(transition, cost, form, steps)
        curvature = form[7:, 7:]
        return -(mp.inverse(curvature) * form[7:, :7]), curvature

    def closed_loop(self, rows: Matrix) -> Matrix:
        """Return the transition of the states `MOVED`, without the limits of the command."""
        change = rows[0, :7].copy()
        change[_COMMAND] -= 1
        loop = self._transition + (self._input * change)
        return mp.matrix([[loop[row, column] for column in _MOVED] for row in _MOVED])

    def steady(self, degree: int) -> tuple[list[Any], Any]:
        """Return state and command of a drone that keeps its distance, 0, to a target in motion.

        The target's acceleration is t^degree / degree!, and now t = 0. The state has the next command for
        `_COMMAND`; the last one stands beside it. Exact at the control steps: the change of the velocity in
        each is the target's, so state and command are polynomials of the step's number.
        """
        period_s = self.period_s
        system, right = mp.zeros(4), mp.zeros(4, degree + 1)
        for i, row in enumerate([*_INNER, 1]):
            for j, column in enumerate([*_INNER, _COMMAND]):
                system[i, j] = self._input[row] if column == _COMMAND else self._transition[row, column]
        for i in range(3):
            system[i, i] -= 1
        for power in range(degree + 1):
            right[3, power] = (
                period_s ** (degree + 1) * mp.binomial(degree + 1, power) / mp.factorial(degree + 1)
            )
        found = mp.zeros(4, degree + 1)
        for power in range(degree, -1, -1):
            wanted = right[:, power].copy()
            for higher in range(power + 1, degree + 1):
                for i in range(3):
                    wanted[i] += mp.binomial(higher, power) * found[i, higher]
            found[:, power] = mp.lu_solve(system, wanted)
        state = [mp.mpf(0)] * 7
        for i, column in enumerate([*_INNER, _COMMAND]):
            state[column] = found[i, 0]
        drift = sum(self._transition[0, column] * state[column] for column in _INNER)
        drift += self._input[0] * state[_COMMAND]
        state[1] = (period_s ** (degree + 2) / mp.factorial(degree + 2) - drift) / period_s
        before = sum(found[3, power] * (-1) ** power for power in range(degree + 1))
        return state, before

    def following(self, rows: Matrix, second_s: Any) -> tuple[list[Any], float]:
        """Return what the moves must take of the target's jerk to follow it without a distance, in SI units.

        And what the first one must take of the jerk's derivative, over that, in s. The second one looks
        further ahead than the first by `second_s`.
        """
        jerk, snap = (self._missing(rows[0, :], degree) for degree in (1, 2))
        jerks = [jerk]
        if rows.rows > 1:
            jerks.append(self._missing(rows[1, :], 1) + second_s)
        return jerks, float(min(max(snap / jerk, 0), _MOST_SNAP_S)) if jerk > 0 else 0.0

    def _missing(self, row: Matrix, degree: int) -> Any:
        """Return by how much the row of a move falls short of the command of a drone in steady motion."""
        state, before = self.steady(degree)
        others = sum(row[k] * state[k] for k in _MOVED if k != _COMMAND)
        return state[_COMMAND] - others - row[_COMMAND] * before

    def scale(self) -> list[Any]:
        """Return the factors from rows for SI units, less the jerk, to rows for steps.

        Moves are in m/step^2; the integral part counts as an acceleration.
        """
        share, period_s = self._loop.integral_1_s, self.period_s
        integral = 1 / share if share else mp.mpf(0)
        one = mp.mpf(1)
        return [period_s**2, period_s, one, one, integral, one, one]


def _model(loop: _Loop, period_s: Any) -> tuple[Matrix, Matrix]:
    """Return how the state answers a change of the command, (7, 7) and (7, 1)."""
    rates, inputs = mp.zeros(6), mp.zeros(6, 1)
    rates[0, 1] = rates[1, 2] = rates[1, 3] = mp.mpf(1)
    rates[2, 2] = -mp.mpf(_DISTURBANCE_POLE_1_S)
    rates[3:, 3:], inputs[3:, 0] = loop.rates(period_s)
    transition, command = hold(rates, inputs, period_s)
    joint, change = mp.eye(7), mp.zeros(7, 1)
    joint[:6, :6], joint[:6, 6] = transition, command
    change[:6, 0], change[6] = command, mp.mpf(1)
    return joint, change


def solve_attitude(update_period_s: float, loop: LoopValues) -> dict[str, Any]:
    """Return the rows of the attitude model and the bound of its states.

    "rows": the next a, i and c from [a, i, c, u], (3, 4). "peak": a bound of |a|, |i|, |c| for |u| <= 1.
    """
    period_s, precise = mp.mpf(update_period_s), _Loop(*loop)
    rows = _rows(precise, period_s)
    return {"rows": rows, "peak": _peak(rows, precise, period_s)}


def _rows(loop: _Loop, period_s: Any) -> Rows:
    transition, inputs = hold(*loop.rates(period_s), period_s)
    share = loop.integral_1_s
    for other in range(3):
        if other != 1:
            transition[1, other] *= share
            transition[other, 1] = transition[other, 1] / share if share else mp.mpf(0)
    inputs[1] *= share
    return [[float(value) for value in (*transition[row, :], inputs[row])] for row in range(3)]


def _peak(rows: Rows, loop: _Loop, period_s: Any) -> float:
    """Return the sums of the absolute impulse responses.

    When all but a slow integral part has settled, responses keep their signs: the sum of the rest is exact.
    Twice that, since the components of a vector that turns are at most the sum of both.
    """
    response, sums = [row[3] for row in rows], [0.0] * 3
    for _ in range(math.ceil(_SETTLING * max(loop.lag_s, loop.delay_s, period_s) / period_s)):
        a, i, c = response
        sums = [total + abs(value) for total, value in zip(sums, response, strict=True)]
        response = [((row[0] * a) + (row[1] * i)) + (row[2] * c) for row in rows]
    rest = mp.lu_solve(mp.eye(3) - mp.matrix([row[:3] for row in rows]), mp.matrix(response))
    return 2.02 * max(1.0, *(total + float(abs(value)) for total, value in zip(sums, rest, strict=True)))


def solve_observer(update_period_s: float, noise: tuple[float, float, float, float]) -> Rows:
    """Return the gain (3, 2) of the stationary Kalman filter, for velocities in m/step and so on.

    `noise` are the densities of acceleration, disturbance, position and velocity.
    """
    period_s = mp.mpf(update_period_s)
    acceleration, disturbance, position, velocity = (mp.mpf(value) ** 2 for value in noise)
    transition, _ = hold(mp.matrix([[0, 1, 0], [0, 0, 1], [0, 0, 0]]), mp.zeros(3, 1), period_s)
    measured = mp.matrix([[1, 0, 0], [0, 1, 0]])
    process = mp.diag([mp.mpf(0), acceleration * period_s, disturbance * period_s])
    noises = mp.diag([position / period_s, velocity / period_s])
    spread = solve_riccati(transition.T, measured.T, process, noises)
    gain = spread * measured.T * mp.inverse((measured * spread * measured.T) + noises)
    return [
        [float(gain[row, column] * period_s ** (row - column)) for column in range(2)] for row in range(3)
    ]


def _floats(matrix: Matrix) -> Rows:
    return [[float(value) for value in row] for row in matrix.tolist()]
