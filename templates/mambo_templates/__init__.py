"""The Jinja templates: the C, firmware folders, pages."""
