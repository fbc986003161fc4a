"""HTML pages in one style that need no other file; all text from files is escaped."""

import base64
import contextlib
import hashlib
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, get_args

import jinja2
from markupsafe import Markup

from mambo_codegen.atomic import put
from mambo_codegen.errors import FileExistsRefusedError, UnwritableError, echo
from mambo_codegen.plain_file import find_obstacle
from mambo_sil.results.blocks import Block, CommandResult, MovingPicture

_MARK: Final = b'<meta name="generator" content="mambo-nmpc">'
"""Marks a page of ours, which may be overwritten."""
_LOOKS: Final = (
    *("passed", "holds", "fits", "recovered", "good", "failed", "crashed", "over", "broken", "refused"),
    *("incomplete", "not-recovered", "weak"),
)
"""Words of a table that have a colour of their own."""


def results_page(
    shown: Sequence[tuple[str, CommandResult]],
    generators: Collection[str],
    progress: Callable[[int], None] = lambda _: None,
) -> str:
    """Return results, each with its folder, as a page; call `progress` with the number of those drawn.

    Raises what the drawing of a picture raises.
    """

    def drawn() -> Iterator[tuple[str, CommandResult]]:
        for number, one in enumerate(shown):
            progress(number)
            yield one

    moving = (one for _, result in shown for one in result.pictures if isinstance(one, MovingPicture))
    context = {"shown": shown, "drawn": drawn(), "generators": sorted(generators)}
    return render_page("report.html.j2", context | {"moves": any(one.drawable for one in moving)})


def render_page(
    template: str,
    context: Mapping[str, Any],
    folder: str = "report",
    styles: Sequence[str] = ("style.css",),
    scripts: Sequence[str] = ("flight.js",),
) -> str:
    """Render a template of a folder of templates; values are escaped unless they are of type `Markup`.

    The folder may use the templates and the style of `report`. The content security policy of the
    page forbids network access and every script but `scripts`, which are joined to one.
    """
    loader = jinja2.ChoiceLoader(
        [jinja2.PackageLoader("mambo_templates", name) for name in dict.fromkeys((folder, "report"))]
    )
    environment = jinja2.Environment(
        loader=loader,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
        keep_trailing_newline=True,
    )
    environment.filters["signs"] = _with_signs
    environment.tests |= {kind.__name__.lower(): _is_a(kind) for kind in (*get_args(Block), MovingPicture)}
    environment.globals["looks"] = _LOOKS
    style, script = (
        "".join(loader.get_source(environment, name)[0] for name in names) for names in (styles, scripts)
    )
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    own = {"style": Markup(style), "script": Markup(script), "script_digest": digest}
    return environment.get_template(template).render({**context, **own})


def _with_signs(text: str) -> str:
    """Return text with the signs of print: m² for m^2, and a plus over its minus."""
    return re.sub(r"(?<=\b[ms])\^2", "²", text).replace(" +- ", " ± ")


def _is_a(kind: type) -> Callable[[object], bool]:
    return lambda one: isinstance(one, kind)


@contextlib.contextmanager
def new_page(output: Path, what: str) -> Iterator[Callable[[str], int]]:
    """Yield a function that writes a page to `output` and returns its size in bytes.

    Raises FileExistsRefusedError, before anything is computed, if there is a file that is no page of ours;
    `what` says what is expected. Raises UnwritableError for a pipe and the like, and if the file system
    refuses. A link to a file stays a link.
    """
    name, place = echo(str(output)), Path(os.path.realpath(output))
    if obstacle := find_obstacle(output):
        raise UnwritableError(f"{name}: is {obstacle}, not a file; name one with -o")

    def write(text: str) -> int:
        page = text.encode("utf-8", "replace")  # a folder's name may be invalid UTF-8
        put(place, page)
        return len(page)

    try:
        if place.is_file() and _MARK not in place.read_bytes()[:1000]:
            raise FileExistsRefusedError(
                f"{name}: exists and is no {what} of mambo-nmpc; name another file with -o"
            )
        yield write
    except OSError as error:
        raise UnwritableError(f"{name}: cannot be written: {error.strerror or error}") from error
