"""The drones that can be flown, each a vehicle.toml: body, rotors, loops and sensors as data."""
