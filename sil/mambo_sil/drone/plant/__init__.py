"""The simulated drone: rigid body, rotors, stock control loops, integrator, disturbances and command link."""
