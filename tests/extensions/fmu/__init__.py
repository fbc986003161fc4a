"""Tests of the mock-up unit."""
