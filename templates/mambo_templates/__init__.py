"""The Jinja templates of a bundle, as text; `mambo_codegen.bundle.render` is their only reader."""
