"""Measurements of time, footprint and plan quality, beside other MPC generators and solvers."""
