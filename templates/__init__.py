"""The Jinja templates of a bundle, as text; `codegen.render` is their only reader."""
