"""Numbers of the C: scalar types, literals, sine and cosine."""
