"""Tests of processor in the loop, and of its firmware."""
