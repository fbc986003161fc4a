"""Margins of a controller on a drone."""
