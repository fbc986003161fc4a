"""The manual: Markdown, pictures, and the modules that write some of its pages."""
