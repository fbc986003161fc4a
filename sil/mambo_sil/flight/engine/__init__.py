"""The closed loop in C, with the bits of the NumPy simulation of plant, sensors and flight."""
