"""Footprint and time of an update beside other generators and solvers, on one problem."""
