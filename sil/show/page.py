"""Pages: HTML in one look that needs no other file; whatever comes from a file is escaped."""

import base64
import hashlib
import math
from collections.abc import Mapping
from typing import Any, Final

import jinja2
from markupsafe import Markup

from mambo_nmpc.sil.paper.table2 import digits, spelled

_SCRIPT: Final = "flight.js"
_DASH: Final = "\N{EN DASH}"


def render_page(template: str, context: Mapping[str, Any]) -> str:
    """Render a template of templates/report; values are escaped unless they are markup made by `sil`.

    The page forbids itself the network and every script but ours.
    """
    loader = jinja2.PackageLoader("mambo_nmpc.templates", "report")
    environment = jinja2.Environment(
        loader=loader,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"digits": _digits, "three": _three}
    style, script = (loader.get_source(environment, name)[0] for name in ("style.css", _SCRIPT))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    own = {"style": Markup(style), "script": Markup(script), "script_digest": digest}
    return environment.get_template(template).render({**context, **own})


def _digits(value: float | None) -> str:
    """Spell a measured value with four digits, and what was not measured as a dash."""
    return _DASH if value is None or not math.isfinite(value) else digits(value)


def _three(value: float | None) -> str:
    """Spell a ratio or a statistic with three digits, and what there is not as a dash."""
    return _DASH if value is None or not math.isfinite(value) else spelled((value,))
