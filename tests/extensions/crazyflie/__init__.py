"""Tests of the Crazyflie's app, its scripts and its flights on the desk."""
