"""Run the how-to guides and keep the pictures that they draw: ``python docs/tools/howto_pictures.py [PAGE ...]``.

A comment ``<!-- picture: PATH -->`` after a block names the picture that it writes.
"""

from __future__ import annotations

import importlib
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "images" / "howto"

sys.path.insert(0, str(ROOT / "tests"))
guides = importlib.import_module("test_howto")


def main() -> None:
    """Draw the pictures of some guides, by default of all, in a folder of its own."""
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        place = guides.prepared(Path(name))
        for page in sys.argv[1:] or guides.pages():
            for block in guides.blocks(page):
                outcome = guides.run(place, block.language, block.text)
                if outcome.returncode != block.code:
                    sys.exit(f"{page}: {block.text}\n{outcome.stdout}\n{outcome.stderr}")
                for picture in block.pictures(place):
                    shutil.copy(picture, PICTURES / f"{page}.png")
                    print(PICTURES / f"{page}.png")


if __name__ == "__main__":
    main()
