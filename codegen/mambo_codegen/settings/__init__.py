"""The settings of a controller: sections, rules, presets, and controller.toml."""
