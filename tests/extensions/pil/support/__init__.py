"""What the tests of processors in the loop share."""
