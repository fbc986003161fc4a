"""The settings of a controller: the validated model, and controller.toml as a way to write it down."""
