"""A flight log in, and what the compiled controller commands on it out."""
