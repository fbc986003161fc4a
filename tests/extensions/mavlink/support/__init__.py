"""What the tests of flights over MAVLink share."""
