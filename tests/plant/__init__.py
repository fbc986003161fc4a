"""Tests of plant."""
