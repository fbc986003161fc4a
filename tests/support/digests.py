"""The digests of the committed bundles over 100,000 frozen steps, as `make generated` writes them."""

import json
from pathlib import Path

from codegen.reference import ReferenceController
from codegen.settings.controller_toml import read
from sil.frozen import TOGETHER, frozen_digest

GENERATED = Path(__file__).parent.parent.parent / "generated"
DIGESTS = GENERATED / "digests.json"
STEPS = 100_000


def digest(bundle: Path) -> str:
    """Return the digest of the reference for the settings of a committed bundle."""
    settings = read(bundle / "controller.toml")
    return frozen_digest(settings, ReferenceController(settings, TOGETHER), STEPS)


def main() -> None:
    """Write the digest of every bundle in generated/."""
    found = {bundle.name: digest(bundle) for bundle in sorted(GENERATED.iterdir()) if bundle.is_dir()}
    DIGESTS.write_text(json.dumps(found, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
