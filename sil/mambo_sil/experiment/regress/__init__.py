"""Regression tests of flights: suites of flights with bounds, and recorded values to compare with."""
