"""What `mambo_nmpc` offers to programs: controllers, vehicles and flights, with arrays in and records out."""
