"""HTML pages: the report and the playground."""
