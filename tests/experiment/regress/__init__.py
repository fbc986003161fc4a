"""Tests of suites of flights."""
