"""Software in the loop: fly the generated C, or its reference, on a Python model of the Parrot Mambo."""
