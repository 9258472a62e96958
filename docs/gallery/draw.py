"""Draw the pictures of the gallery, or those named: `python docs/gallery/draw.py [butterfly ...]`."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).parent


def scripts() -> list[Path]:
    """The script of each picture."""
    return sorted(file for file in HERE.glob("*.py") if file != Path(__file__))


def main(names: list[str]) -> None:
    """Write the pictures beside their scripts."""
    for script in scripts():
        if not names or script.stem in names:
            runpy.run_path(str(script))["picture"]().save(script.with_suffix(".svg"))
            print(script.with_suffix(".svg").name)


if __name__ == "__main__":
    main(sys.argv[1:])
