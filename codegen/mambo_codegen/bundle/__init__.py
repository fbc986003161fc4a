"""A bundle: templates rendered to text, and text written to a folder."""
