"""Tests of sil/mambo_sil/flight/api."""
