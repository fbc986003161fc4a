"""From which figures a picture was drawn: their digest stands in the PNG."""

import hashlib
import json
from pathlib import Path
from typing import Any, Final

from PIL import Image
from PIL.PngImagePlugin import PngInfo

_KEY: Final = "Figures"


def id_of(figures: Any) -> str:
    """Return the digest of figures that JSON can hold."""
    return hashlib.sha256(json.dumps(figures, sort_keys=True).encode()).hexdigest()[:16]


def keep(drawn: Path, picture: Path, figures: Any) -> None:
    """Copy a PNG to a picture of the manual, with the digest of the figures from which it was drawn."""
    text = PngInfo()
    text.add_text(_KEY, id_of(figures))
    with Image.open(drawn) as image:
        image.save(picture, pnginfo=text, optimize=True)


def is_drawn_from(picture: Path, figures: Any) -> bool:
    """Return whether a picture was drawn from these figures."""
    if not picture.is_file():
        return False
    with Image.open(picture) as image:
        return bool(image.info.get(_KEY) == id_of(figures))
