"""HTML pages in one style that need no other file; all text from files is escaped."""

import base64
import hashlib
from collections.abc import Mapping
from typing import Any, Final

import jinja2
from markupsafe import Markup

from mambo_nmpc.sil.show.numbers import digits_or_dash, fixed_or_dash, three_digits_or_dash

_SCRIPT: Final = "flight.js"


def render_page(template: str, context: Mapping[str, Any]) -> str:
    """Render a template of templates/report; values are escaped unless they are of type `Markup`.

    The content security policy of the page forbids network access and every script but flight.js.
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
    environment.filters |= {"digits": digits_or_dash, "three": three_digits_or_dash, "fixed": fixed_or_dash}
    style, script = (loader.get_source(environment, name)[0] for name in ("style.css", _SCRIPT))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    own = {"style": Markup(style), "script": Markup(script), "script_digest": digest}
    return environment.get_template(template).render({**context, **own})
