"""Benedict and Bordner's filter of a value and its change: none is better for both noise and ramps."""

from typing import Any

import numpy as np
from scipy.linalg import solve_discrete_lyapunov


def no_pair_is_better(gain: float, change_gain: float) -> bool:
    """Return whether no other pair of gains is better in both: variance by noise, and error of a ramp."""
    pair, change = np.array([gain, change_gain]), 1e-5 * np.eye(2)
    noise, error = (
        np.array([cost(*(pair + one)) - cost(*(pair - one)) for one in change])
        for cost in (_variance, _transient)
    )
    across = noise[0] * error[1] - noise[1] * error[0]
    are_parallel = abs(across) < 1e-4 * np.linalg.norm(noise) * np.linalg.norm(error)
    return bool(are_parallel and noise @ error < 0)


def _filter(gain: float, change_gain: float) -> tuple[Any, Any]:
    """Return transition (2, 2) and input (2,) of [value, change]; the input is the measurement."""
    transition = np.array([[1 - gain, 1 - gain], [-change_gain, 1 - change_gain]])
    return transition, np.array([gain, change_gain])


def _variance(gain: float, change_gain: float) -> float:
    """Return the variance of the value under white noise of variance 1."""
    transition, by = _filter(gain, change_gain)
    return float(solve_discrete_lyapunov(transition, np.outer(by, by))[0, 0])


def _transient(gain: float, change_gain: float) -> float:
    """Return the sum of squared errors of the predicted value after its change has jumped by 1."""
    transition, by = _filter(gain, change_gain)
    state, total = np.zeros(2), 0.0
    for step in range(4000):
        total += (step - state[0]) ** 2
        state = transition @ state + by * (step + 1)
    return total
