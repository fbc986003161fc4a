"""Tests of Table II."""
