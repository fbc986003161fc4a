"""The paper in NumPy: eqs 8-12 and RPROP for one drone, written to be read, with the paper's symbols.

What the paper leaves open, or prints in a way that does not fly, is decided in `docs/explanation/paper.md`;
"(3)" is departure 3 there. The generated C computes the same up to rounding, in fewer operations, as
`docs/explanation/kernel.md` derives.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.one_norm.horizon import shortened_lags_s
from mambo_codegen.settings.sections import Sections

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """Moves U (N_c, 2), whose first is the command u*; cost of the last iteration; updates; convergence."""

    U: Array
    J: float
    updates: int
    converged: bool


@dataclass(frozen=True)
class Paper:
    """The controller of `settings`.

    R is the state x, y, vx, vy, phi, theta, psi; T the target x, y, vx, vy, and its acceleration ax, ay, 0 in
    the paper (24); u_1_m the thrust over the mass; U the moves (N_c, 2), phi and theta; u_last the last
    command.
    """

    settings: Sections

    def eq_8(self, psi: float, u_1_m: float) -> Array:
        """Return the matrix (2, 2) that gives the acceleration along x, y from phi, theta."""
        sin = np.sin(psi) if self.settings.model.yaw_convention == "printed" else -np.sin(psi)  # (3)
        return u_1_m * np.array([[sin, -np.cos(psi)], [np.cos(psi), sin]])

    def roll_out(self, R: Array, T: Array, u_1_m: float, U: Array) -> Array:
        """Return the errors r - Tp (N_p, 2) of eqs 8-11, one row for each predicted step."""
        tau, model = self.settings.horizon.prediction_step_s, self.settings.model
        lag = np.array(shortened_lags_s(self.settings))  # (5)
        decay = np.where(lag > 0, np.exp(-tau / np.where(lag > 0, lag, 1.0)), 0.0)
        tau_2_half = tau**2 / 2 if model.position_update == "exact" else tau / 2  # (1)
        r, v, angle, Tp, Tv, Ta = R[0:2], R[2:4], R[4:6], T[0:2], T[2:4], T[4:6]
        matrix = self.eq_8(R[6], u_1_m)
        errors = []
        for i in range(self.settings.horizon.prediction):
            u = U[min(i, len(U) - 1)]  # after N_c the last move is held (10)
            rest = angle - u  # the lag lets it decay to zero: rest * exp(-t / lag)
            once = lag * (1 - decay) * rest  # integral of that over tau
            twice = lag * (tau - lag * (1 - decay)) * rest  # and integrated again (19)
            r = r + tau * v + matrix @ (tau_2_half * u + twice)  # eq 9
            v = v + matrix @ (tau * u + once)  # (2)
            angle = u + decay * rest
            Tp = Tp + tau * Tv + tau_2_half * Ta  # eq 11
            Tv = Tv + tau * Ta
            errors.append(r - Tp)
        return np.array(errors)

    def track(self, Ta: Array, Tj: Array, measured: Array) -> tuple[Array, Array]:
        """Return acceleration and jerk of the target from the acceleration that its velocities have (24)."""
        settings, T_s = self.settings, self.settings.horizon.update_period_s
        alpha = settings.target.tracker_gain
        beta = alpha**2 / (2 - alpha)
        limit = min(1.5 * 9.81 * settings.limits.tilt_rad, 2 * settings.ranges.velocity_m_s / T_s)
        jump = np.abs(measured) > limit
        rest = measured - (Ta + T_s * Tj)
        acceleration = Ta + T_s * Tj + alpha * rest
        jerk = np.clip(Tj + beta / T_s * rest, -0.1 * limit / T_s, 0.1 * limit / T_s)
        return np.where(jump, Ta, acceleration), np.where(jump, 0.0, jerk)

    def responses(self, R: Array, T: Array, u_1_m: float) -> Array:
        """Return the derivatives (N_p, 2, N_c, 2) of the errors by U, in which they are affine."""
        shape = (self.settings.horizon.control, 2)
        free = self.roll_out(R, T, u_1_m, np.zeros(shape))
        units = np.eye(2 * shape[0]).reshape(-1, *shape)
        columns = [self.roll_out(R, T, u_1_m, unit) - free for unit in units]
        return np.stack(columns, axis=-1).reshape(*free.shape, *shape)

    def eq_12(self, errors: Array, U: Array, u_last: Array) -> float:
        """Return the cost J."""
        lambda_1, lambda_2 = self.settings.cost.tracking_weight, self.settings.cost.effort_weight
        delta_U = np.diff(np.vstack([u_last, U]), axis=0)  # (11)
        return float(lambda_1 * np.abs(errors).sum() + lambda_2 * np.abs(delta_U).sum())

    def gradient(self, errors: Array, responses: Array, U: Array, u_last: Array) -> Array:
        """Return a subgradient of J by U, (N_c, 2)."""
        lambda_1, lambda_2 = self.settings.cost.tracking_weight, self.settings.cost.effort_weight
        sign_delta_U = np.sign(np.diff(np.vstack([u_last, U]), axis=0))
        effort = sign_delta_U - np.vstack([sign_delta_U[1:], [0, 0]])  # a move enters two changes
        tracking = np.einsum("ix,ixca->ca", np.sign(errors), responses)
        return np.asarray(lambda_1 * tracking + lambda_2 * effort)

    def rprop(self, R: Array, T: Array, u_1_m: float, U: Array, *, u_last: Array) -> Solution:
        """Search from the initial guess U, the paper's Omega_k (6), by RPROP."""
        table_1, limit = self.settings.optimizer, self.settings.limits.tilt_rad
        responses = self.responses(R, T, u_1_m)
        U, U_previous = U.copy(), U.copy()
        Delta, sign_previous = np.full_like(U, table_1.initial_step_rad), np.zeros_like(U)  # U_step (7)
        J, updates, converged = np.inf, 0, False
        for _ in range(table_1.iterations):  # I_max
            errors, J_previous = self.roll_out(R, T, u_1_m, U), J
            J = self.eq_12(errors, U, u_last)
            converged = abs(J - J_previous) < table_1.tolerance  # epsilon (8)
            if converged:
                break
            updates += 1
            sign = np.sign(self.gradient(errors, responses, U, u_last))
            for k in np.ndindex(U.shape):
                if sign[k] * sign_previous[k] < 0:  # stepped over a minimum
                    Delta[k] = np.maximum(
                        table_1.decrease * Delta[k], table_1.step_min_rad
                    )  # eta-, Delta_min
                    U[k] = U_previous[k] if table_1.variant == "rprop+" else U[k]  # (9, 15)
                    sign_previous[k] = 0
                    continue
                if sign[k] * sign_previous[k] > 0:
                    Delta[k] = np.minimum(
                        table_1.increase * Delta[k], table_1.step_max_rad
                    )  # eta+, Delta_max
                U_previous[k] = U[k]
                U[k] = np.clip(U[k] - sign[k] * Delta[k], -limit, limit)  # (12)
                sign_previous[k] = sign[k]
        return Solution(U, J, updates, converged)
