"""Flights with faults: injection, the list of faults, flights and their verdicts."""
