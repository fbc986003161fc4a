"""The bill of materials of a bundle: SPDX 2.3 as JSON, for programs that list what a firmware is made of."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Final

from mambo_codegen import __version__

SBOM: Final = "sbom.spdx.json"
_LICENSE: Final = "MIT-0"
_COPYRIGHT: Final = "Copyright 2026 The mambo-nmpc authors"
_CREATED: Final = "2026-01-01T00:00:00Z"
"""SPDX demands a time; a bundle is a function of its settings, so this one says nothing."""


def with_sbom(files: Mapping[str, str]) -> dict[str, str]:
    """Return `files`, {relative POSIX path: text}, with the bill of materials of all of them.

    It lists each file with its hashes, and one package, the controller, that contains them and depends on
    nothing: the C calls no library.
    """
    contents = {path: files[path].encode() for path in sorted(files)}
    listed = [_file(number, path, content) for number, (path, content) in enumerate(contents.items())]
    sha1s = "".join(sorted(_hash("sha1", content) for content in contents.values()))
    code = _hash("sha1", sha1s.encode())
    package = {
        "SPDXID": "SPDXRef-Controller",
        "name": "mambo-nmpc-controller",
        "versionInfo": __version__,
        "supplier": "NOASSERTION",
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": True,
        "packageVerificationCode": {"packageVerificationCodeValue": code},
        "licenseConcluded": _LICENSE,
        "licenseDeclared": _LICENSE,
        "licenseInfoFromFiles": [_LICENSE],
        "copyrightText": _COPYRIGHT,
        "primaryPackagePurpose": "SOURCE",
    }
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": "mambo-nmpc-controller",
        "documentNamespace": f"https://spdx.org/spdxdocs/mambo-nmpc-controller-{code}",
        "creationInfo": {
            "created": _CREATED,
            "creators": [f"Tool: mambo-nmpc-{__version__}"],
            "comment": "The time is a constant: the same settings give the same files.",
        },
        "documentDescribes": [package["SPDXID"]],
        "packages": [package],
        "files": listed,
        "relationships": [
            {
                "spdxElementId": package["SPDXID"],
                "relationshipType": "CONTAINS",
                "relatedSpdxElement": one["SPDXID"],
            }
            for one in listed
        ],
    }
    return {**files, SBOM: json.dumps(document, indent=1) + "\n"}


def _file(number: int, path: str, content: bytes) -> dict[str, Any]:
    """Return the entry of a file."""
    return {
        "SPDXID": f"SPDXRef-File-{number}",
        "fileName": f"./{path}",
        "fileTypes": ["SOURCE" if path.endswith((".c", ".h", ".cpp", ".hpp")) else "TEXT"],
        "checksums": [
            {"algorithm": name.upper(), "checksumValue": _hash(name, content)} for name in ("sha1", "sha256")
        ],
        "licenseConcluded": _LICENSE,
        "licenseInfoInFiles": [_LICENSE],
        "copyrightText": _COPYRIGHT,
    }


def _hash(name: str, content: bytes) -> str:
    return hashlib.new(name, content, usedforsecurity=False).hexdigest()
