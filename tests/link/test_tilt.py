"""Roll and pitch of one direction of the thrust, seen from two headings."""

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import to_world
from mambo_sil.link.tilt import turned_tilt


def test_the_thrust_points_where_it_did() -> None:
    """In the world, for random tilts of up to 69 degrees and headings, against the rotation of the plant."""
    random = np.random.default_rng(6)
    for roll_rad, pitch_rad, yaw_rad, turn_rad in random.uniform(-1.2, 1.2, (50, 4)) * [1.0, 1.0, 1.0, 2.6]:
        there = [*turned_tilt(roll_rad, pitch_rad, turn_rad), yaw_rad + turn_rad]
        np.testing.assert_allclose(direction(there), direction([roll_rad, pitch_rad, yaw_rad]), atol=1e-12)


def direction(attitude_rad: list[float]) -> FloatArray:
    """Return where the thrust points (3,) at roll, pitch, yaw."""
    return to_world(*sine_cosine(np.array(attitude_rad)), np.array([0.0, 0.0, -1.0]))
