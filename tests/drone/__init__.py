"""Tests of the room `drone`."""
