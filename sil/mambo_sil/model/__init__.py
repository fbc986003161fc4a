"""From a flight log to a vehicle, from a vehicle to settings, and logs replayed."""
