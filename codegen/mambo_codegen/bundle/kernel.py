"""The kernel: chapters of nmpc.c that are plain C, whose lines `#if WITH_...` a loader hands to Jinja.

A chapter has no hole, and no condition within a line. Whether a part is there is a line of its own, with
bare names of parts, `and`, `or` and `not`, which C has from <iso646.h>: a C compiler reads the chapter as
it stands, with -DWITH_GUARD=1 and the like, and Jinja reads the same lines as block tags. A bundle has none
of these lines. A line `#include "predictor.h"` stands for the constants and tables of a chapter, which a
template of that name writes. Every other directive of C stays.
"""

import re
from collections.abc import Callable
from typing import Final

import jinja2

KERNEL: Final = "kernel/"
"""The folder of the chapters, among the templates."""

_DIRECTIVE: Final = re.compile(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif)\b(.*)")
_HEAD: Final = re.compile(r'#include "(\w+\.h)"')


class KernelLoader(jinja2.PackageLoader):
    """Loads templates, and chapters of the kernel with tags."""

    def get_source(
        self, environment: jinja2.Environment, template: str
    ) -> tuple[str, str, Callable[[], bool] | None]:
        """Return text, path, and what says whether the file is still the same."""
        text, path, is_current = super().get_source(environment, template)
        if template.startswith(KERNEL):
            text = with_tags(with_head(text, template.removeprefix(KERNEL).partition("/")[0]))
        return text, path, is_current


def with_head(chapter: str, folder: str) -> str:
    """Return a chapter in which the template of its constants in `folder` stands for their `#include`."""
    return _HEAD.sub(rf'{{% include "{folder}/\1.j2" %}}', chapter)


def with_tags(chapter: str) -> str:
    """Return a chapter whose `#if WITH_...` to their `#endif` are tags of Jinja, each on its line."""
    ours: list[bool] = []
    lines = chapter.splitlines(keepends=True)
    for number, found in enumerate(map(_DIRECTIVE.match, lines)):
        if found is None:
            continue
        word, condition = found[1], found[2].strip()
        if word.startswith("if"):
            ours.append(word == "if" and condition.startswith(("WITH_", "not WITH_")))
        if ours[-1]:
            lines[number] = f"{{% {found[0].strip()[1:].strip()} %}}\n"
        if word == "endif":
            ours.pop()
    return "".join(lines)
