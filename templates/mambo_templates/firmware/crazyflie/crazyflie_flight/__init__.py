"""Flights of a Crazyflie from a computer: what `fly.py` and `offboard.py` beside this package share."""
