"""Tests of the life of a flight, without a transport."""
