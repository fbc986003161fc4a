"""Monte Carlo: flights with random parameters, several controllers on the same flights, and statistics."""
