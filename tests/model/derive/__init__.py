"""Tests of sil/mambo_sil/model/derive."""
