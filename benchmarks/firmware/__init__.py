"""The Crazyflie's firmware as a program on the desk, with the generated app beside its own controllers."""
