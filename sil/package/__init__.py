"""Nonlinear model predictive control in static-memory C99 for very small drones.

`mambo_nmpc.codegen` generates C from settings and `mambo_nmpc.templates`; `mambo_nmpc.sil` simulates flights
with that C, and tests it.
"""
