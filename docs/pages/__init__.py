"""Pages of the manual that are written from the code; `mkdocs.yml` names the hook that adds them."""
