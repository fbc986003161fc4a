"""Tests of sil/mambo_sil/experiment/compare."""
