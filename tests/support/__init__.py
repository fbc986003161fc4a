"""What several tests share: inputs, settings, builds. Tests import these, never each other."""
