"""What fills the gaps of a log, and how well it says that it does."""

import numpy as np
import pytest

from mambo_sil.model.replay.interpolation import fill

LOST = np.random.default_rng(1).random(1000) < 0.1
LOST[:3] = LOST[-3:] = False


@pytest.mark.parametrize(("noise", "better"), [(0.0, 0.6), (0.1, 1.01)], ids=["a curve", "noise"])
def test_a_gap_is_filled_as_well_as_it_says(noise: float, better: float) -> None:
    """A curve by cubics, where the samples beside it are there, noise by lines."""
    true = np.sin(0.2 * np.arange(1000)) + noise * np.random.default_rng(2).normal(size=1000)
    filled, spread = fill(np.where(LOST, np.nan, true), ~LOST)
    error = filled - true
    assert (error[~LOST] == 0.0).all()
    assert (spread[~LOST] == 0.0).all()
    assert np.sqrt(np.square(error[LOST] / spread[LOST]).mean()) == pytest.approx(1.0, abs=0.3)
    line = np.interp(np.arange(1000), np.flatnonzero(~LOST), true[~LOST]) - true
    assert np.square(error).sum() < better * np.square(line).sum()


def test_what_lies_beyond_the_ends_is_held() -> None:
    """With the spread of the whole column."""
    there = np.arange(100) > 4
    filled, spread = fill(np.where(there, np.arange(100.0), np.nan), there)
    assert filled[:5].tolist() == [5.0] * 5
    assert spread[0] == pytest.approx(np.arange(5.0, 100.0).std())
