"""The Crazyflie: the app that `generate --for crazyflie` writes, and its flights on the desk."""
