"""How results look: plots, pages, animation."""
