"""The description of the package: README with links that hold where it is read, on the index."""

import re
from typing import Any, Final

from hatchling.metadata.plugin.interface import MetadataHookInterface

_PICTURE: Final = re.compile(r"^\[?!\[[^\]]*\]\((?!https?:)[^)]*\)(?:\]\([^)]*\))?\n+", re.MULTILINE)
"""A line that is a picture of the repository, and may be a link too."""
_LINK: Final = re.compile(r"(!?)\[((?:!\[[^\]]*\]\([^)]*\)|[^\]])*)\]\((?!https?:|#)([^)\s]+)\)")
_COMMENT: Final = re.compile(r"<!--.*?-->\n+", re.DOTALL)


class CustomMetadataHook(MetadataHookInterface):
    """What hatchling calls."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the readme of the metadata, from README.md and the address of the repository, if it has one."""
        with open(f"{self.root}/README.md", encoding="utf-8") as file:  # noqa: PTH123 - hatchling's root is text
            text = described(file.read(), metadata.get("urls", {}).get("Repository", ""))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def described(readme: str, repository: str) -> str:
    """Return README with links into the repository, as GitHub has them; without them if it has no address."""
    text = _COMMENT.sub("", readme)
    if not repository:
        return _LINK.sub(r"\2", _PICTURE.sub("", text))
    base = repository.rstrip("/")

    def absolute(found: re.Match[str]) -> str:
        mark, words, path = found.groups()
        kind = "raw" if mark else "blob"
        return f"{mark}[{_LINK.sub(absolute, words)}]({base}/{kind}/HEAD/{path})"

    return _LINK.sub(absolute, text)
