"""Seeded Monte Carlo: many drawn flights, several controllers on the same draws, and statistics of both."""
