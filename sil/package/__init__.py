"""Nonlinear model predictive control in static-memory C99 for very small drones.

`mambo_nmpc.codegen` turns settings into C, `mambo_nmpc.sil` flies that C, `mambo_nmpc.templates` is the C.
"""
