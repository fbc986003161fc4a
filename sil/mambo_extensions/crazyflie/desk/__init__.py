"""The generated app of a Crazyflie, compiled unchanged, with what surrounds it in the firmware."""
