"""The life of a flight, without a transport: checks, take-off, courses, lost estimates, landing."""
