"""Flights with faults: what is injected, which faults are flown, and what became of each."""
