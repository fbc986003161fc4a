"""Keep compiled templates in the user's cache: to compile them takes a third of the time of `generate`."""

from typing import Final

import jinja2
from jinja2.bccache import Bucket

from mambo_codegen.user_cache import read_cached, write_cached

_FOLDER: Final = "templates"


class TemplateCache(jinja2.BytecodeCache):
    """Compiled templates, each in a file; Jinja compiles again what is missing or has another text."""

    def load_bytecode(self, bucket: Bucket) -> None:
        """Load a template if the cache has it."""
        content = read_cached(_FOLDER, bucket.key)
        if content is not None:
            bucket.bytecode_from_string(content)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Store a compiled template."""
        write_cached(_FOLDER, bucket.key, bucket.bytecode_to_string())
