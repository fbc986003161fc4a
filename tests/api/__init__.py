"""Tests of sil/mambo_sil/api."""
