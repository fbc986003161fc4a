"""Tuning: a search for settings that track well with calm commands, on drawn flights of the compiled C."""
