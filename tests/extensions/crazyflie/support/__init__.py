"""What the tests of the Crazyflie share."""
