"""Flights of ours in one condition after another: limits, the height, starts within a millimetre."""
