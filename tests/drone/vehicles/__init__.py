"""Tests of the drones as data."""
