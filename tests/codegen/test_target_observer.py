"""The target's observer: what it makes of set-points with noise, jumps, accelerations, and other frames."""

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.target_observer import ObservedMotion, TargetObserver, unknown_target
from mambo_codegen.methods.quadratic.target_observer_constants import target_observer_constants
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS
from tests.support.height_settings import height_settings
from tests.support.parity import inputs_of_steps
from tests.support.quadratic import TWO_MOVES, Array, settings_of

PERIOD_S: Final = 0.01
NAN, INF = math.nan, math.inf
SETTINGS: Final = settings_of(TWO_MOVES | {"code.scalar": "float64"})
OBSERVER: Final = target_observer_constants(SETTINGS)
SNAP_S: Final = float(Quadratic(SETTINGS).law.snap_s.mean())
"""The feed-forward gain of the snap."""
MOST_M_S: Final = PERIOD_S * 1.5 * 9.81 * 0.5
"""The largest change of the velocity in a step, less noise, that is no jump."""


class Seen:
    """An observer of n targets, and what it has made of their set-points."""

    def __init__(self, settings: Settings = SETTINGS, n: int = 1) -> None:
        self.tracker: TargetObserver = Quadratic(settings).reference_controller(n).parts.target_observer
        self.n = n
        self.motion: ObservedMotion = unknown_target(np.zeros((n, 2)))
        self.aim: Array = np.zeros((n, 4))

    def see(self, velocity: Any, given: Any = 0.0, ahead: Any = 0.0, known: int = 0) -> ObservedMotion:
        """Take a set-point at the origin, whose vectors have the shape (n, 2) or less."""
        parts = (np.broadcast_to(part, (self.n, 2)) for part in (0.0, velocity, given, ahead))
        program = np.concatenate([*parts, np.full((self.n, 1), known)], axis=1)
        free = np.zeros(self.n, np.bool_)
        self.motion, self.aim = self.tracker.follow(self.motion, program, program[:, :4], free)
        return self.motion


def derivatives(coefficients: Array, time_s: float) -> list[Any]:
    """Return the polynomial (k,) or (k, 2), of the lowest power first, and its derivatives, per step^i."""
    one = np.polynomial.polynomial
    return [PERIOD_S**k * one.polyval(time_s, one.polyder(coefficients, k)) for k in range(4)]


def fit_of(motion: ObservedMotion) -> Array:
    """Return velocity and derivatives (4, n, 2)."""
    return np.stack([motion.velocity_m_s, motion.acceleration, motion.jerk, motion.snap])


CUBIC: Final = np.array([[0.3, -0.2], [0.5, 0.7], [-0.4, 0.3], [0.8, -0.6]])
"""Velocities along x and y, by powers of the time in s."""


@pytest.mark.parametrize("drag_1_s", [0.0, 0.3])
def test_a_cubic_without_noise_is_followed_exactly(drag_1_s: float) -> None:
    """Velocity and derivatives are its own; A_T is a, J_T is j, the law's share of s, and the drag of A_T."""
    settings = with_option(SETTINGS, "model.drag_1_s", drag_1_s)
    seen = Seen(settings)
    for step in range(300):
        motion = seen.see(derivatives(CUBIC, (step - 200) * PERIOD_S)[0])
    own = derivatives(CUBIC, 99 * PERIOD_S)
    assert fit_of(motion)[:, 0] == pytest.approx(np.array(own), abs=1e-9)
    assert motion.memory[0] == pytest.approx([18, 18], abs=1e-3)
    acceleration_m_s2, jerk_m_s3, snap_m_s4 = (own[k] / PERIOD_S**k for k in (1, 2, 3))
    jerk_m_s3 += Quadratic(settings).law.snap_s[0] * snap_m_s4 + drag_1_s * acceleration_m_s2
    assert motion.acceleration_m_step2[0] / PERIOD_S**2 == pytest.approx(acceleration_m_s2, abs=1e-6)
    assert motion.jerk_m_step2_update[0] / PERIOD_S**3 == pytest.approx(jerk_m_s3, abs=1e-3)
    assert (seen.aim[:, 2:4] == motion.velocity_m_s).all()


def test_a_desired_velocity_is_tracked_and_feeds_where_it_is_to() -> None:
    """Its acceleration is found without a lag, a jump leaves it, and the fit of the program stays."""
    seen = Seen()
    motion = seen.see(0.3)
    yes, no = np.array([True]), np.array([False])
    for step in range(60):
        desired = np.array([[0.01 * step, 0.3 - 0.005 * step]])
        motion = seen.tracker.follow_limits(motion, desired, np.array([step > 0]), no)
        assert motion.acceleration_m_step2.tobytes() == seen.motion.acceleration_m_step2.tobytes()
    fed = seen.tracker.follow_limits(motion, np.add(desired, (0.01, -0.005)), yes, yes)
    assert fed.acceleration_m_step2[0] / PERIOD_S == pytest.approx([0.01, -0.005], rel=1e-6)
    assert fed.jerk_m_step2_update == pytest.approx(0.0, abs=1e-9)
    assert (fit_of(fed) == fit_of(seen.motion)).all()
    jumped = seen.tracker.follow_limits(fed, desired + 1.0, yes, yes)
    assert jumped.acceleration_m_step2.tobytes() == fed.acceleration_m_step2.tobytes()
    assert (jumped.desired_jerk == 0).all()
    begun = seen.tracker.follow_limits(fed, desired, no, yes)
    assert begun.desired_acceleration.tobytes() == seen.motion.acceleration.tobytes()


@pytest.mark.parametrize("sigma_m_s", [0.005, 0.01, 0.02, 0.04])
def test_white_noise_is_measured_and_lengthens_the_memory(sigma_m_s: float) -> None:
    """What is new changes as the noise does, and by a little more since the fit errs; the memory follows."""
    seen, random = Seen(n=100), np.random.default_rng(3)
    motions = [seen.see(random.normal(0.0, sigma_m_s, (100, 2))) for _ in range(400)][150:]
    noise, memory = (np.mean([getattr(one, name) for one in motions]) for name in ("noise", "memory"))
    assert 1.1 < noise / (2 / math.sqrt(math.pi) * sigma_m_s) < 1.25
    assert memory == pytest.approx(min(18 + 3200 * noise, 42 + 800 * noise, 76), rel=0.02)


@pytest.mark.parametrize("known", [0, 1])
def test_one_wild_set_point_is_not_believed_and_the_second_is(known: int) -> None:
    """For the first the prediction stands; at the second what is told counts, and jerk and snap are 0."""
    seen = Seen()
    for step in range(250):
        now = derivatives(CUBIC, (step - 149) * PERIOD_S)
        seen.see(now[0], now[1] / PERIOD_S, known=known)
    path = np.array(derivatives(CUBIC, 1.01))
    wild = path - np.sign(path[1]) * (0.9 if known else 1.5) * MOST_M_S
    first = seen.see(wild[0], wild[1] / PERIOD_S, known=known)
    assert fit_of(first)[known:, 0] == pytest.approx(path[known:], abs=1e-8)
    assert (first.missed == 1).all()
    predicted = first.acceleration + first.jerk + first.snap / 2
    later = seen.see(wild[0], wild[1] / PERIOD_S, known=known)
    assert (later.velocity_m_s == wild[0]).all()
    assert later.acceleration == pytest.approx(wild[1:2] if known else predicted, abs=1e-12)
    assert (fit_of(later)[2:] == 0).all()
    assert (np.stack([later.missed, later.memory]) == [[[0]], [[0 if known else 32]]]).all()


@pytest.mark.parametrize(("known", "noise"), [(0, 0.0), (0, 0.03), (1, 0.0)])
def test_a_jump_is_more_than_the_limit_and_four_times_the_noise(known: int, noise: float) -> None:
    """A change just below is believed and counts in the noise with its size, one beyond with the limit."""
    seen, trust = Seen(n=4), (0.1 if known else 1.0) * MOST_M_S + 4 * noise
    for _ in range(1 if noise else 450):
        seen.see(0.0)
    change = np.array([[0.999], [-0.999], [1.001], [-5.0]]) * trust
    motion = seen.see(change, change / PERIOD_S, known=known)
    assert motion.missed[:, 0].tolist() == [0, 0, 1, 1]
    assert (motion.innovation == np.where(motion.missed == 0, change, 0)).all()
    counted = np.minimum(np.abs(change), trust)
    assert motion.noise[:, :1] == pytest.approx(0.94 * noise + 0.06 * counted, rel=1e-9)


def test_a_memory_that_is_too_long_falls_by_two_and_one_that_is_too_short_grows_by_one() -> None:
    """As far as the noise asks for; below the cubic's 18 it does not fall."""
    seen = Seen()
    seen.see(0.0)
    seen.motion = replace(seen.motion, noise=0 * seen.motion.noise, memory=25 + 0 * seen.motion.memory)
    assert [seen.see(0.0).memory[0, 0] for _ in range(5)] == [23, 21, 19, 18, 18]
    grown = [seen.see(0.03 * (-1) ** step).memory[0, 0] for step in range(80)]
    assert grown[:20] == list(range(19, 39))
    assert grown[-1] == 76


def test_the_acceleration_of_a_very_noisy_target_does_not_count() -> None:
    """Its share, and the jerk's, is a line of the noise from 1 to 0; a known acceleration counts wholly."""
    seen, random = Seen(n=30), np.random.default_rng(4)
    beliefs, limit = [], 10 * PERIOD_S**2 * MOST_M_S
    for step in range(200):
        motion = seen.see(random.normal(0.0, 0.002 * step, (30, 2)))
        belief = np.clip(1.5 - OBSERVER.fade * motion.noise, 0.0, 1.0)
        jerk = belief * (PERIOD_S * motion.jerk + Quadratic(SETTINGS).law.snap_s[0] * motion.snap)
        assert motion.acceleration_m_step2 == pytest.approx(belief * motion.acceleration / 100, abs=1e-15)
        assert motion.jerk_m_step2_update == pytest.approx(np.clip(jerk, -limit, limit), abs=1e-15)
        beliefs.append(belief)
    assert [np.min(beliefs), np.max(beliefs)] == [0, 1]
    assert seen.see(0.0, 1.0, 1.0, known=2).acceleration_m_step2 == pytest.approx(PERIOD_S**2)


def test_noise_of_known_accelerations_lengthens_their_memory() -> None:
    """The deviation of a from a mean of 0 is that of a parabola through 8 + 100 h values, h in m/s^2."""
    seen, random = Seen(n=200), np.random.default_rng(5)
    for sigma in (0.01, 0.05, 0.4):
        for _ in range(100):
            motion = seen.see(0.0, random.normal(0.0, sigma, (200, 2)), known=1)
        n = np.minimum(8 + 100 * motion.noise / PERIOD_S, 20).mean()
        share = 3 * (3 * n * n - 3 * n + 2) / (n * (n + 1) * (n + 2))
        assert motion.acceleration.std() == pytest.approx(PERIOD_S * sigma * math.sqrt(share), rel=0.1)


def test_an_acceleration_ahead_gives_the_jerk() -> None:
    """The difference of both over 0.05 s, at most the limit: that of the first one is the jerk of now too."""
    for given, ahead, jerk_m_s3 in ((1.0, 1.2, 4.0), (0.5, 0.3, -4.0), (-5.0, 5.0, 73.575)):
        motion = Seen().see(0.2, given, ahead, known=2)
        told = [0.2, given * PERIOD_S, jerk_m_s3 * PERIOD_S**2, 0.0]
        assert fit_of(motion)[:, 0, 1] == pytest.approx(told, rel=1e-9)
        assert motion.jerk_m_step2_update[0, 0] == pytest.approx(jerk_m_s3 * PERIOD_S**3, rel=1e-9)


def test_the_change_of_the_jerk_ahead_gives_the_snap() -> None:
    """Its mean over 0.1 s, of an acceleration that is a parabola 3 t^2: the jerk counts as that of now."""
    seen = Seen()
    for step in range(100):
        now, ahead = (3.0 * (step * PERIOD_S + later_s) ** 2 for later_s in (0.0, 0.05))
        motion = seen.see(0.2, now, ahead, known=2)
        snap_m_s4 = 6.0 * (1.0 - 0.9**step)
        assert motion.snap[0, 0] == pytest.approx(snap_m_s4 * PERIOD_S**3, rel=1e-6, abs=1e-15)
        jerk_m_s3 = 6.0 * (step * PERIOD_S + 0.025) + (SNAP_S - 0.025) * snap_m_s4
        assert motion.jerk_m_step2_update[0, 0] == pytest.approx(jerk_m_s3 * PERIOD_S**3, rel=1e-6)
    assert motion.snap[0, 0] > 0.9998 * 6.0 * PERIOD_S**3
    for step in range(40):
        motion = seen.see(0.2, (-1) ** step, (-1) ** (step + 1), known=2)
    most_m_s4 = 1.5 * 9.81 * SETTINGS.limits.tilt_rad * 6.4
    assert 0.9 * most_m_s4 * PERIOD_S**3 < np.abs(motion.snap).max() <= most_m_s4 * PERIOD_S**3 * (1 + 1e-9)


def test_the_first_set_point_says_what_it_knows() -> None:
    """Noise is expected of a velocity only, also of the first one after accelerations that were known."""
    for known, told in enumerate(([0.7, 0, 0], [0.7, 0.02, 0], [0.7, 0.02, 4e-4])):
        seen = Seen()
        motion = seen.see(0.7, 2.0, 2.2, known=known)
        assert fit_of(motion)[:3, 0, 0] == pytest.approx(told, rel=1e-9)
        assert (motion.memory == (0 if known else 32)).all()
        assert (motion.noise == (0 if known else 0.03)).all()
        seen.see(0.71, 2.3, 2.4, known=1)
        motion = seen.see(seen.motion.velocity_m_s + seen.motion.acceleration)
        assert [motion.memory[0, 0], motion.noise[0, 0]] == pytest.approx([33, 0.94 * 0.03], abs=1e-4)
        motion = seen.see(0.73, (motion.acceleration + motion.jerk + motion.snap / 2) / PERIOD_S, known=1)
        assert [motion.memory[0, 0], motion.noise[0, 0]] == pytest.approx([0, 0], abs=1e-12)


def test_a_jump_of_the_frame_moves_the_fit_and_a_turn_turns_it() -> None:
    """And what is fed; after a turn the next velocity counts as it is, since it turns about the drone's."""
    turn, change = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]), np.array([3.0, -4.0])
    controller, seen = Quadratic(SETTINGS).reference_controller(1), Seen()
    units = PERIOD_S ** np.arange(4.0)[:, None, None]
    for step in range(200):
        velocity, turned = derivatives(CUBIC, (step - 100) * PERIOD_S)[0], turn if step > 149 else np.eye(2)
        seen.see(velocity)
        told = turned @ velocity + change * (step > 99)
        controller.step(np.zeros((1, 7)), [[0.0, 0.0, *told, *np.zeros(5)]], [9.81])
        own_error = seen.motion.velocity_m_s[0] - velocity if step < 150 else np.zeros(2)
        assert controller.memory.target.velocity_m_s[0] - told == pytest.approx(own_error, abs=1e-6)
        if step in (99, 149):
            assert controller.frame_jumped([[0, 0, *(change * (step == 99)), 0.7 * (step == 149)]]) == [
                Status.OK
            ]
        found, own, turned = controller.memory.target, seen.motion, turn if step > 148 else np.eye(2)
        assert (fit_of(found) / units)[1:] == pytest.approx((fit_of(own) @ turned.T / units)[1:], abs=1e-4)
        fed, fed_own = (np.stack([x.acceleration_m_step2, x.jerk_m_step2_update]) for x in (found, own))
        assert fed / units[2:] == pytest.approx(fed_own @ turned.T / units[2:], abs=1e-2)
        assert (found.missed == (2 if step == 149 else 0)).all()


@pytest.mark.parametrize("known", [0, 1])
def test_no_set_point_takes_the_fit_beyond_its_limits(known: int) -> None:
    """Each derivative reaches its own; the noise of velocities too; what is known counts wholly."""
    seen, values, random = Seen(n=50), [], np.random.default_rng(6)
    for step in range(200):
        told = random.normal(0.0, 1e-4 * step**2, (50, 2))
        motion = seen.see(told, told / PERIOD_S, known=known)
        values.append([*fit_of(motion)[1:], motion.noise, motion.jerk_m_step2_update / PERIOD_S])
    *fit, noise, fed = np.abs(values).max(axis=(0, 2, 3))
    most = OBSERVER.level
    assert fit == pytest.approx([most.acceleration, most.jerk, most.row[2 + known]], rel=1e-9)
    if not known:
        assert noise == OBSERVER.most_noise
        return
    assert noise > 1 / OBSERVER.fade
    assert motion.acceleration_m_step2 == pytest.approx(PERIOD_S * motion.acceleration, rel=1e-12)
    assert fed == pytest.approx(most.jerk, rel=1e-9)
    turned = seen.tracker.turn(motion, np.zeros(50), -np.ones(50))
    assert fit_of(turned)[1:] == pytest.approx(-fit_of(motion)[1:], rel=1e-12)
    assert (turned.innovation == 0).all()


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize(("known", "unread"), [(0, (4, 5, 8, 9, 10, 11)), (1, (9, 10, 11)), (2, ())])
def test_members_that_are_not_known_do_not_count(scalar: str, known: int, unread: tuple[int, ...]) -> None:
    """Equal bits with these accelerations as with their opposites, within limits or not; others count."""
    settings = height_settings(scalar)
    controller, kept = Quadratic(settings).reference_controller(30), []
    for inputs in inputs_of_steps(settings, 10, 30, seed=8):
        own = inputs.target.copy()
        own[:, 12] = known
        same, other = own.copy(), own.copy()
        same[:, unread] *= -1
        other[:, [one for one in (4, 9, 11) if one not in unread]] *= -1
        controller.step(np.tile(inputs.state, (3, 1)), np.concatenate([own, same, other]))
        kept.append(controller.stored.reshape(3, 10, -1))
    assert (controller.memory.limits.active != 0).any()
    own, same, other = np.stack(kept, axis=1)
    assert (own == same).all()
    assert (own == other).all() == (known == 0)


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize(("column", "value"), [(12, 3), (12, -1), (12, NAN), (6, NAN), (4, INF), (11, NAN)])
def test_a_bad_target_is_refused_and_changes_no_fit(scalar: str, column: int, value: float) -> None:
    """A member that is not finite, or `known` beyond 0 to 2: status 3, and what is known of it stays."""
    controller = Quadratic(height_settings(scalar)).reference_controller(1)
    target, state = np.zeros((1, 13)), np.zeros((1, 10))
    target[:, 2], target[:, 7] = 0.05, 0.03
    assert controller.step(state, target).status == [Status.OK]
    before = controller.memory
    target[:, column] = value
    assert controller.step(state, target).status == [Status.BAD_TARGET] == [3]
    for found, own in zip(*([x.target, x.height.target] for x in (controller.memory, before)), strict=True):
        assert (fit_of(found) == fit_of(own)).all()
        assert (fit_of(own)[0, :, 0] > 0).all()


@pytest.mark.parametrize("known", [0, 1, 2])
def test_the_height_of_a_target_is_observed_as_its_place(known: int) -> None:
    """The same motion upwards as along x has the same fit; its jerk counts by the law of the height."""
    method = Quadratic(height_settings("float64"))
    controller = method.reference_controller(1)
    for step in range(150):
        path = [0.5 * one / PERIOD_S**k for k, one in enumerate(derivatives(CUBIC[:, 0], step * PERIOD_S))]
        told = path[0], path[1], path[1] + 0.05 * path[2]
        target = [0, 0, told[0], 0, told[1], 0, 0, told[0], told[1], told[2], 0, told[2], known]
        controller.step(np.zeros((1, 10)), [target])
    level, climb = controller.memory.target, controller.memory.height.target
    assert fit_of(level)[:, :, :1] == pytest.approx(fit_of(climb), rel=1e-12)
    assert climb.acceleration_m_step2 == pytest.approx(PERIOD_S * climb.acceleration, rel=1e-12)
    assert method.height is not None
    jerk = PERIOD_S * climb.jerk + (method.height.snap_s - 0.025 * (known == 2)) * climb.snap
    assert climb.jerk_m_step2_update == pytest.approx(jerk, rel=1e-12)
    controller.step(np.zeros((1, 10)), [[0.0] * 8 + [9.0, 0.0, 0.0, -20.0, 2]])
    assert controller.memory.height.target.acceleration == pytest.approx(0.09), "up it can more than along x"
