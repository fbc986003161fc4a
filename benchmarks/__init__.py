"""Measurements of time, footprint and flights, beside other MPC generators and solvers."""
