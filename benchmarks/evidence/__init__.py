"""Tables and pictures of the manual: what makes them, and whether they are older than the code."""
