"""Emulated processor cores that run the C as built for a board."""
