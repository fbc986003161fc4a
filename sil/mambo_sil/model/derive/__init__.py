"""Settings of a controller, derived from the drone that it is to fly."""
