"""The target observer and the numbers of the jerk, by docs/explanation/kernel.md and nothing else."""

import math
from collections import Counter
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from mambo_codegen.settings.model import Settings

Array = NDArray[np.float64]
Loop = tuple[float, float, float]
"""Lag and delay in s, and the integral in 1/s, which the height has not: 0."""

G_M_S2 = 9.81


def clamp(value: float, bound: float) -> float:
    """Limit `value` to plus or minus `bound`."""
    return min(max(value, -bound), bound)


def inverse(n: int, size: int) -> list[list[Fraction]]:
    """Return the inverse of Q(n), by docs/explanation/kernel.md, for `size` coefficients."""
    sums = [Fraction(sum((-age) ** power for age in range(n))) for power in range(2 * size)]
    rows = [sums[k : k + size] + [Fraction(k == column) for column in range(size)] for k in range(size)]
    for k in range(size):
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for row in set(range(size)) - {k}:
            rows[row] = [own - rows[row][k] * one for own, one in zip(rows[row], rows[k], strict=True)]
    return [row[size:] for row in rows]


def gains(size: int, least: int, most: int) -> list[list[float]]:
    """Return K_i(n), or P_i(n) with a size of 3, for n from `least` to `most`."""
    inverses = (inverse(n, size) for n in range(least, most + 1))
    return [[float(math.factorial(i) * one[i][0]) for i in range(size)] for one in inverses]


class Numbers:
    """The constants of an observer along x and y, or of the height, by docs/explanation/kernel.md."""

    def __init__(self, settings: Settings, snap_s: float, *, is_height: bool) -> None:
        """`snap_s` is the page's t of that axis."""
        height, ranges = settings.height, settings.ranges
        self.period_s, self.snap_s = settings.horizon.update_period_s, snap_s
        step, most_m_s2 = self.period_s, ranges.thrust_acceleration_max_m_s2
        level_m_s2 = self.most_m_s2 = min(1.5 * G_M_S2 * settings.limits.tilt_rad, most_m_s2)
        if is_height and height:
            largest = max(G_M_S2 - height.thrust_min_m_s2, height.thrust_max_m_s2 - G_M_S2)
            self.most_m_s2 = min(1.5 * largest, most_m_s2)
        self.drag = 0.0 if is_height else settings.model.drag_1_s * step
        self.v, self.a = ranges.velocity_m_s, step * self.most_m_s2
        self.j = self.a * min(1, 10 * step)
        self.s, self.known_s = (self.a * min(1, share * step**2) for share in (2.1, 6.4))
        self.jump, self.known_jump = min(self.a, self.v), 0.1 * self.a
        self.n_0, self.n_1, self.n_2, self.n_f = (self._count(t, 5) for t in (0.18, 0.42, 0.76, 0.32))
        self.m_0, self.m_2 = (self._count(t, 4) for t in (0.08, 0.2))
        q = math.sqrt(step / 0.01)
        self.c_0, self.c_1, self.c_2 = 32 * q / step, 8 * q / step, q / step**2
        self.gamma = min(1, 6 * step)
        self.gains, self.known_gains = gains(4, self.n_0, self.n_2), gains(3, self.m_0, self.m_2)
        deviation = 0.06 * (level_m_s2 / 1.5) * step / math.sqrt(inverse(self.n_2, 4)[1][1])
        self.h_1 = 2 / math.sqrt(math.pi) * deviation
        self.most_h = min(6 * self.h_1, self.v / 4)
        fed = step * self.a, step * self.j
        # Of what is kept.
        self.scales = [*fed, 1.0, self.a, self.j, self.s, self.a, self.most_h, 1.0, 1.0, 1.0, self.a, self.j]

    def _count(self, time_s: float, least: int) -> int:
        return max(min(round(time_s / self.period_s), 250), least)


class ObservedAxis:
    """The observer along one axis, by docs/explanation/kernel.md; `cases` counts what has happened."""

    def __init__(self, numbers: Numbers, cases: Counter[str]) -> None:
        self.numbers, self.cases = numbers, cases
        self.forget()

    def forget(self) -> None:
        """Forget all that is observed."""
        self.v = self.a = self.j = self.s = self.nu = self.h = self.n = self.fed_a = self.fed_j = 0.0
        self.desired, self.d, self.e = math.nan, math.nan, math.nan
        self.m, self.is_first = 0, True

    def kept(self) -> list[float]:
        """Return A_T, J_T, v, a, j, s, nu, h, n, m, and v_d, d and e, NaN before limits act."""
        fit = self.v, self.a, self.j, self.s, self.nu, self.h, self.n, self.m
        return [self.fed_a, self.fed_j, *fit, self.desired, self.d, self.e]

    def step(self, given: Array, known: int) -> float:
        """Take in a velocity, an acceleration, one 0.05 s later (3,). Return T_v without limits."""
        velocity = float(given[0])
        now, later = (clamp(self.numbers.period_s * float(one), self.numbers.a) for one in given[1:])
        self._begin(known)
        if self.is_first or known == 2:
            self._start(velocity, now, later, known)
        else:
            self._predict()
            if known == 0:
                self._correct_velocity(velocity)
            else:
                self._correct_acceleration(velocity, now)
        self._feed(known)
        return self.v if known == 0 else velocity

    def follow(self, desired: float, *, begins: bool, feeds: bool) -> None:
        """Take in v_d while limits act; `begins` in the first such step, `feeds` where A_T is that of v_d."""
        number, alpha = self.numbers, 0.58
        change, before = desired - self.desired, self.d + self.e
        if begins:
            self.cases["limits begin"] += 1
            self.d, self.e = self.a, 0.0
        elif abs(change) <= number.a:
            self.cases["limited"] += 1
            self.d = clamp(before + alpha * (change - before), number.a)
            self.e = clamp(self.e + alpha**2 / (2 - alpha) * (change - before), number.j)
        else:
            self.cases["limited jump"] += 1
            self.e = 0.0
        self.desired = desired
        self.cases["fed by limits" if feeds else "fed by the target"] += 1
        if feeds:
            self.fed_a = number.period_s * self.d
            self.fed_j = clamp(
                number.period_s * self.e + number.drag * self.fed_a, number.period_s * number.j
            )

    def shift(self, change_m_s: float) -> None:
        """Move with the frame."""
        self.v = clamp(self.v + change_m_s, self.numbers.v)
        self.desired = clamp(self.desired + change_m_s, self.numbers.v)

    def _begin(self, known: int) -> None:
        """Velocities or accelerations begin."""
        if known == 0 and self.n == 0:
            self.n, self.h, self.nu = self.numbers.n_f, 0.03, 0.0
            self.cases["velocities begin"] += not self.is_first
        elif known and self.n > 0:
            self.n = self.h = self.nu = 0.0
            self.cases["accelerations begin"] += 1

    def _start(self, velocity: float, now: float, later: float, known: int) -> None:
        """Take what is given: the first set-point, and every one with `known` 2."""
        self.cases[f"first, known {known}"] += self.is_first
        before = self.j
        self.a = now if known else 0.0
        self.j = clamp((later - now) * self.numbers.period_s / 0.05, self.numbers.j) if known == 2 else 0.0
        grown = min(1, self.numbers.period_s / 0.1) * (self.j - before - self.s)
        self.s = 0.0 if self.is_first else clamp(self.s + grown, self.numbers.known_s)
        self.v, self.nu, self.m, self.is_first = velocity, 0.0, 0, False

    def _predict(self) -> None:
        """Predict a step."""
        v, a, j, s = self.v, self.a, self.j, self.s
        self.v, self.a, self.j = v + (a + (j / 2 + s / 6)), a + (j + s / 2), j + s

    def _judge(self, x: float, jump: float) -> str:
        """Return whether the set-point is "accepted", "rejected", or a "jump"."""
        trust, was = jump + 4 * self.h, self.m
        change = min(abs(x - self.nu), trust)
        self.h = min(self.h + self.numbers.gamma * (change - self.h), self.numbers.most_h)
        self.cases["largest noise"] += self.h == self.numbers.most_h
        accepted = abs(x) <= trust
        self.nu, self.m = (x, 0) if accepted else (0.0, int(was == 0))
        return "accepted" if accepted else "rejected" if was == 0 else "jump"

    def _correct_velocity(self, velocity: float) -> None:
        """Correct by the velocity."""
        number, has_turned = self.numbers, self.m == 2
        x = 0.0 if has_turned else velocity - self.v
        verdict = self._judge(x, number.jump)
        self.cases["turned, known 0" if has_turned else f"{verdict} velocity"] += 1
        if has_turned:
            self.v = velocity
        elif verdict == "accepted":
            most = min(number.n_0 + number.c_0 * self.h, number.n_1 + number.c_1 * self.h, number.n_2)
            self.cases["shorter memory"] += self.n + 1 > most
            self.n = self.n + 1 if self.n + 1 <= most else max(self.n - 2, most)
            gain = number.gains[int(self.n) - number.n_0]
            self.v += gain[0] * x
            self._gain(gain[1:], x)
        elif verdict == "jump":
            self.v, self.j, self.s, self.n = velocity, 0.0, 0.0, number.n_f
        self._limit(number.s)

    def _correct_acceleration(self, velocity: float, now: float) -> None:
        """Correct by the acceleration."""
        number, x = self.numbers, now - self.a
        self.cases["turned, known 1"] += self.m == 2
        verdict = self._judge(x, number.known_jump)
        self.cases[f"{verdict} acceleration"] += 1
        if verdict == "accepted":
            memory = min(number.m_0 + number.c_2 * self.h, number.m_2)
            self._gain(number.known_gains[int(memory) - number.m_0], x)
        elif verdict == "jump":
            self.a, self.j, self.s = now, 0.0, 0.0
        self.v = velocity
        self._limit(number.known_s)

    def _gain(self, gain: list[float], x: float) -> None:
        """Add the shares of the innovation to a, j and s."""
        for name, share in zip("ajs", gain, strict=True):
            setattr(self, name, getattr(self, name) + share * x)

    def _limit(self, most_s: float) -> None:
        """Limit v, a, j and s."""
        number = self.numbers
        for name, most in zip("vajs", (number.v, number.a, number.j, most_s), strict=True):
            setattr(self, name, clamp(getattr(self, name), most))
            self.cases[f"largest {name}"] += abs(getattr(self, name)) == most

    def _feed(self, known: int) -> None:
        """Set A_T and J_T."""
        number = self.numbers
        self.fed_a = number.period_s * self.a
        self.fed_j = number.period_s * self.j + (number.snap_s - 0.025 * (known == 2)) * self.s
        share = 1.5 - self.h / (2 * number.h_1)
        if known == 0 and share < 1:
            self.cases["faded" if share > 0 else "faded wholly"] += 1
            self.fed_a, self.fed_j = self.fed_a * max(share, 0), self.fed_j * max(share, 0)
        self.fed_j = clamp(self.fed_j + number.drag * self.fed_a, number.period_s * number.j)


def turn(x: ObservedAxis, y: ObservedAxis, angle_rad: float) -> None:
    """Turn the pairs along x and y with the frame, by docs/explanation/kernel.md."""
    sine, cosine, number, step = math.sin(angle_rad), math.cos(angle_rad), x.numbers, x.numbers.period_s
    fed = step * number.a, step * number.j
    limits = number.a, number.j, number.known_s, *fed, number.v, number.a, number.j
    names = "a", "j", "s", "fed_a", "fed_j", "desired", "d", "e"
    for name, limit in zip(names, limits, strict=True):
        first, second = getattr(x, name), getattr(y, name)
        setattr(x, name, clamp(first * cosine - second * sine, limit))
        setattr(y, name, clamp(second * cosine + first * sine, limit))
    x.nu, y.nu, x.m, y.m = 0.0, 0.0, 2, 2


def following(period_s: float, loop: Loop, power: int) -> tuple[float, Array, float, float]:
    """Return v_0, z_0 (3,), u_0 and u_-1 of a drone that follows t^power/power! without a distance."""
    lag_s, delay_s, integral_1_s = loop
    rates = np.zeros((6, 6))
    a, i, c, velocity, place, u = range(6)
    rates[a, [a, i, c if delay_s else u]] = -1 / lag_s, 1 / lag_s, 1 / lag_s
    rates[i, [a, i, u]] = -integral_1_s, -0.001 if integral_1_s else -1, integral_1_s
    rates[c, [c, u]] = -1 / (delay_s or period_s), 1 / (delay_s or period_s)
    rates[velocity, a] = rates[place, velocity] = 1
    held = expm(rates * period_s)
    equations = held[[a, i, c, velocity]][:, [a, i, c, u]] - np.diag([1, 1, 1, 0])
    found = np.zeros((4, power + 1))
    for k in range(power, -1, -1):
        wanted = np.zeros(4)
        for higher in range(k + 1, power + 1):
            wanted[:3] += math.comb(higher, k) * found[:3, higher]
        wanted[3] = period_s ** (power + 1) * math.comb(power + 1, k) / math.factorial(power + 1)
        found[:, k] = np.linalg.solve(equations, wanted)
    moved = float(held[place, [a, i, c, u]] @ found[:, 0])
    v_0 = (period_s ** (power + 2) / math.factorial(power + 2) - moved) / period_s
    return v_0, found[:3, 0], float(found[3, 0]), float(found[3] @ (-1.0) ** np.arange(power + 1))


def jerk_numbers(period_s: float, ramp_s: float, loop: Loop, rows: Array) -> tuple[list[float], float]:
    """Return the numbers of j in steps of rows (moves, 8) in steps, and t, by "The numbers of the jerk"."""

    def number(row: Array, power: int, later_s: float = 0.0) -> float:
        v_0, attitude, command, before = following(period_s, loop, power)
        return command + later_s - float(row[1] / period_s * v_0 + row[4:7] @ attitude + row[7] * before)

    numbers = [number(row, 1, ramp_s / 3 if move else 0.0) for move, row in enumerate(rows)]
    snap_s = number(rows[0], 2) / numbers[0] if numbers[0] > 0 else 0.0
    return [one / period_s for one in numbers], min(max(snap_s, 0.0), 1.0)
