"""Flights in simulators of others: their plants, their controllers, other laws, and the generated C."""
