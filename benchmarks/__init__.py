"""Measurements: what is faster than what, in one run on one machine."""
