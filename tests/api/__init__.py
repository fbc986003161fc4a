"""Tests of sil/api."""
