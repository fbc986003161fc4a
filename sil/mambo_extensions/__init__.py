"""Extensions of the core: it never imports them, and none imports another; `pyproject.toml` joins them."""
