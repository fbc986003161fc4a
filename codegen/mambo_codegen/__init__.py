"""Turn the settings of a controller into static-memory C99: settings in, C out; no plant and no plot."""

__version__ = "0.4.0"
