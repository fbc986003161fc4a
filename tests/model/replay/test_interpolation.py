"""What fills the gaps of a log, and how well it says that it does."""

import numpy as np
import pytest

from mambo_sil.model.replay.interpolation import fill

LOST = np.random.default_rng(1).random(1000) < 0.1
LOST[[0, 1, 2, -3, -2, -1]] = False
LOST[500:508] = True


@pytest.mark.parametrize("noise", [0.0, 0.1], ids=["a curve", "noise"])
def test_a_gap_is_filled_as_well_as_it_says(noise: float) -> None:
    """A curve by cubics, noise by lines; the spread is the error of what is filled."""
    true = np.sin(0.05 * np.arange(1000)) + noise * np.random.default_rng(2).normal(size=1000)
    filled, spread = fill(np.where(LOST, np.nan, true), ~LOST)
    error = filled - true
    assert (error[~LOST] == 0.0).all()
    assert (spread[~LOST] == 0.0).all()
    assert np.sqrt((error[LOST] ** 2).mean()) == pytest.approx(np.sqrt((spread[LOST] ** 2).mean()), rel=0.3)
    line = np.interp(np.arange(1000), np.flatnonzero(~LOST), true[~LOST]) - true
    assert np.abs(error).max() < 0.1 * np.abs(line).max() or noise > 0.0


def test_a_step_is_no_curve() -> None:
    """A line leaves less of it."""
    true = np.repeat([0.0, 1.0, 0.0, 1.0], 250)
    filled, _ = fill(np.where(LOST, np.nan, true), ~LOST)
    assert filled.min() == 0.0
    assert filled.max() == 1.0


def test_what_lies_beyond_the_ends_is_held() -> None:
    """With the spread of the whole column."""
    there = np.arange(100) > 4
    filled, spread = fill(np.where(there, np.arange(100.0), np.nan), there)
    assert filled[:5].tolist() == [5.0] * 5
    assert spread[0] == pytest.approx(np.arange(5.0, 100.0).std())
