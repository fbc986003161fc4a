"""What a program says of its target: a curve that can be sampled, a preview where somebody knows it."""

import math
from typing import Any

import numpy as np
import pytest

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import TARGETS
from mambo_nmpc import ArgumentError, Controller, DroneState, TargetState, Vehicle, fly
from mambo_nmpc.curves import Circle, curve, preview, sample
from mambo_sil.flight.controllers.compiled import CompiledController
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import settings_of

TOLD = settings_of(CRAZYFLIE | {"target.acceleration": "preview"})


def test_a_preview_is_the_acceleration_of_the_curve_later() -> None:
    """At each of its times, in the frame that is asked for."""
    helix, times_s = curve("helix", 1.0, 1.5), np.array([0.5, 2.0])
    ahead = preview(helix, times_s, "NWU")
    assert ahead.shape == (2, 6, 3)
    for number in range(6):
        later = sample(helix, times_s + 0.05 * (number + 1), "NWU")
        np.testing.assert_allclose(ahead[:, number], later.acceleration_m_s2, atol=1e-12)


def test_the_controller_reads_it_in_every_frame() -> None:
    """The command is that of the C for the numbers in its own frame, z upwards."""
    eight = curve("swinging-eight", 2.0, 1.2)
    now = sample(eight, 0.7, "NWU")
    target = TargetState.in_frame("NWU", *now, preview_m_s2=preview(eight, 0.7, "NWU"))
    state = DroneState.in_frame("NWU", now.position_m, now.velocity_m_s, np.zeros(3))
    found = Controller(TOLD).step(state, target)
    place, speed, bent = (np.asarray(part) * (1.0, 1.0, -1.0) for part in sample(eight, 0.7))
    ahead = preview(eight, 0.7) * (1.0, 1.0, -1.0)
    measured = np.concatenate([place[:2], speed[:2], np.zeros(3), [place[2], speed[2], 0.0]])
    wanted = np.concatenate([place[:2], speed[:2], bent[:2], [place[2], speed[2], bent[2]], ahead.ravel()])
    expected = CompiledController(TOLD).step(measured[None], wanted[None])
    np.testing.assert_array_equal(found.status, 0)
    np.testing.assert_allclose(found.command_rad, expected.command_rad[0], atol=1e-6)
    assert found.thrust_m_s2 is not None
    np.testing.assert_allclose(found.thrust_m_s2, expected.thrust_m_s2[0], rtol=1e-6)


def test_a_missing_preview_and_another_shape_are_named() -> None:
    """By the name of the argument."""
    still = np.zeros(3)
    with pytest.raises(ArgumentError, match=r"preview_m_s2: has shape \(5, 3\); it must be \(6, 3\)"):
        TargetState(still, still, still, preview_m_s2=np.zeros((5, 3)))
    with pytest.raises(ArgumentError, match="target: preview_m_s2 is missing; the settings have"):
        Controller(TOLD).step(DroneState(still, still, still), TargetState(still, still, still))


def test_what_gets_its_targets_takes_it() -> None:
    """The firmware of a processor in the loop has a target of 27 numbers."""
    assert (
        "pil_assert_target_has_27_numbers" in render_target(TOLD, TARGETS["pil"], with_digest=False)["pil.c"]
    )


@pytest.mark.parametrize(
    ("trajectory", "time_s", "message"),
    [
        (None, 0.0, "trajectory = None must have the methods target and acceleration"),
        (Circle, 0.0, "trajectory = .* must have the methods target and acceleration"),
        (
            Circle(math.nan, 1.0),
            0.0,
            r"trajectory = Circle\(radius_m=nan, .*\) must be finite at these times",
        ),
        (Circle(1.0, 1.0), [0.0, math.nan], r"time_s = \[0\.0, nan\] must be finite"),
        (Circle(1.0, 1.0), math.inf, "time_s = inf must be finite"),
        (Circle(1.0, 1.0), "now", 'time_s = "now" must be numbers'),
    ],
)
def test_what_cannot_be_sampled_is_refused(trajectory: Any, time_s: Any, message: str) -> None:
    """By name and value: no curve, a curve that is NaN, and times that are not finite."""
    with pytest.raises(ArgumentError, match=message):
        sample(trajectory, time_s)


def test_a_curve_of_nan_is_not_flown() -> None:
    """It would be a flight without a target."""
    pilot, vehicle = Controller.from_preset("crazyflie"), Vehicle.from_preset("crazyflie")
    with pytest.raises(ArgumentError, match=r"trajectory = Circle\(radius_m=nan, .*\) must be finite at 0 s"):
        fly(pilot, vehicle, Circle(math.nan, 1.0))
