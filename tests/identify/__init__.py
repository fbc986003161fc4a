"""Tests of the identification."""
