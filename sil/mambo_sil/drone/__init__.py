"""The simulated drone: vehicles as data, plant, sensors."""
