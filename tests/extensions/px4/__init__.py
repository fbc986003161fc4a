"""Tests of PX4's module."""
