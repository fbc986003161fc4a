"""Presentation of results: style of pictures, HTML pages, sections of the report, format of numbers."""
