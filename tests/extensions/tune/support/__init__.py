"""What the tests of tuning share."""
