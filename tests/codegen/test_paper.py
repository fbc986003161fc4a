"""The reference equals `paper.py`, eqs 8-12 and RPROP as they are written, up to rounding."""

import numpy as np
import pytest

from mambo_codegen.methods.one_norm import cost
from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.one_norm.paper import Array, Paper
from mambo_codegen.methods.one_norm.predictor import Predictor
from mambo_codegen.methods.shared.tracker import Tracker, unknown_motion
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import settings_case as drawn_settings


def settings_case(index: int, scalar: str) -> Settings:
    """Make the settings number `index` without limits of speed, braking and place: the paper has none."""
    document = drawn_settings(index, scalar).model_dump()
    return Settings.model_validate(document | {"limits": {"tilt_rad": document["limits"]["tilt_rad"]}})


CASES = [index for index in range(60) if settings_case(index, "float64").horizon.prediction <= 20]


class Situation:
    """A random state, target and thrust, a last command and a plan."""

    def __init__(self, settings: Settings, rng: np.random.Generator, scale: float = 1.0) -> None:
        self.state = scale * rng.normal(0, 1, 7) * [1, 1, 1, 1, 0.3, 0.3, 3]
        self.target = scale * rng.normal(0, 1, 6)
        if settings.target.acceleration == "none":
            self.target[4:] = 0
        self.thrust = rng.uniform(5, 15)
        self.last = rng.uniform(-0.3, 0.3, 2)
        self.plan = rng.uniform(-0.3, 0.3, (settings.horizon.control, 2))

    def inputs(self) -> tuple[Array, Array, float]:
        """Return state, target and thrust."""
        return self.state, self.target, self.thrust


def situation(index: int) -> tuple[Settings, Paper, Situation]:
    """Return case `index`."""
    settings = settings_case(index, "float64")
    return settings, Paper(settings), Situation(settings, np.random.default_rng(index))


@pytest.mark.parametrize("index", CASES)
def test_errors_cost_and_gradient_are_those_of_the_paper(index: int) -> None:
    """The recurrence gives the errors of a roll-out, with and without lag, exact and printed."""
    settings, paper, case = situation(index)
    method = OneNorm(settings)
    predictor = Predictor(method, OneNormArithmetic(method))
    weights = np.array([[settings.cost.tracking_weight, settings.cost.effort_weight]])
    acceleration = case.target[None, 4:] * settings.horizon.prediction_step_s**2 if method.tracker else None
    prediction = predictor.prepare(
        case.state[None], case.target[None, :4], np.array([case.thrust]), acceleration
    )
    errors = predictor.errors(prediction, case.plan[None])[:, 0]
    costs, gradients = cost.evaluate(predictor, prediction, weights, case.plan[None], case.last[None])

    expected = paper.roll_out(*case.inputs(), case.plan)
    gradient = paper.gradient(expected, paper.responses(*case.inputs()), case.plan, case.last)
    np.testing.assert_allclose(errors, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    assert costs[0] == pytest.approx(paper.eq_12(expected, case.plan, case.last), rel=1e-10)
    np.testing.assert_allclose(gradients[0], gradient, rtol=0, atol=1e-10 * np.abs(gradient).max())


@pytest.mark.parametrize("index", CASES)
def test_the_gradient_is_that_of_the_cost(index: int) -> None:
    """Away from its kinks, the cost changes with each move as the gradient says."""
    settings, paper, case = situation(index)
    errors, responses = paper.roll_out(*case.inputs(), case.plan), paper.responses(*case.inputs())
    gradient = paper.gradient(errors, responses, case.plan, case.last)
    for move in np.ndindex(case.plan.shape):
        offset = np.zeros_like(case.plan)
        offset[move] = 1e-6
        more, less = (
            paper.eq_12(paper.roll_out(*case.inputs(), plan), plan, case.last)
            for plan in (case.plan + offset, case.plan - offset)
        )
        largest_weight = max(settings.cost.tracking_weight, settings.cost.effort_weight)
        assert gradient[move] == pytest.approx((more - less) / 2e-6, rel=1e-4, abs=1e-6 * largest_weight)


@pytest.mark.parametrize("index", CASES)
def test_the_search_is_that_of_the_paper(index: int) -> None:
    """Five consecutive steps: plan, cost, updates and convergence."""
    settings, rng = settings_case(index, "float64"), np.random.default_rng(index)
    controller, paper = OneNormController(OneNorm(settings)), Paper(settings)
    plan, last = np.zeros((settings.horizon.control, 2)), np.zeros(2)
    acceleration, jerk, velocity = np.zeros(2), np.zeros(2), np.zeros(2)
    for index_of_step in range(5):
        case = Situation(settings, rng, scale=0.2)
        told, is_first = case.target, index_of_step == 0
        if settings.target.acceleration == "tracked":
            before, velocity = velocity, velocity + settings.horizon.update_period_s * rng.normal(0, 1, 2)
            if not is_first:
                measured = (velocity - before) / settings.horizon.update_period_s
                acceleration, jerk = paper.track(acceleration, jerk, measured)
            told = np.append(case.target[:2], velocity)
            case.target[2:] = *velocity, *acceleration
        guess = plan if settings.optimizer.warm_start == "plan" else np.tile(last, (len(plan), 1))
        expected = paper.rprop(*case.inputs(), guess, u_last=last)
        step = controller.step(case.state[None], told[None], [case.thrust])
        assert step.status[0] == 0
        np.testing.assert_allclose(step.plan_rad[0], expected.U, rtol=0, atol=1e-12)
        assert step.cost[0] == pytest.approx(expected.J, rel=1e-9)
        assert (step.iterations[0], step.converged[0]) == (expected.updates, expected.converged)
        plan, last = expected.U, expected.U[0]


@pytest.mark.parametrize("index", range(6))
def test_the_tracker_is_that_of_the_paper(index: int) -> None:
    """A target's acceleration and jerk over 200 steps, with jumps and at their limits."""
    settings = with_option(settings_case(index, "float64"), "target.acceleration", "tracked")
    method, paper, rng = OneNorm(settings), Paper(settings), np.random.default_rng(index)
    constants = method.tracker
    assert constants is not None
    tracker = Tracker(constants, OneNormArithmetic(method))
    motion = tracker.update(unknown_motion(np.zeros((1, 2))), np.zeros((1, 2)))
    acceleration, jerk, velocity = np.zeros(2), np.zeros(2), np.zeros(2)
    step_squared_s2, update_s = settings.horizon.prediction_step_s**2, settings.horizon.update_period_s
    for step in range(200):
        if step % 5 == 0:
            change = constants.tested_change_m_s * rng.uniform(-1, 1, 2)
        velocity = velocity + change
        acceleration, jerk = paper.track(acceleration, jerk, change / update_s)
        motion = tracker.update(motion, velocity[None])
        most = constants.acceleration_limit_m_step2
        for found, expected in (
            (motion.acceleration_m_step2[0], step_squared_s2 * acceleration),
            (motion.jerk_m_step2_update[0], step_squared_s2 * update_s * jerk),
        ):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * most)
