"""The Jinja templates of a bundle, as text; `mambo_nmpc.codegen.render` is their only reader."""
