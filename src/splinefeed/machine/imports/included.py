"""Files that a configuration names, to be read in its place: few, small, and beside it or below."""

from __future__ import annotations

from pathlib import Path

from splinefeed.errors import FormatError
from splinefeed.files.source import read_text

#: Files that may be included in each other, files in all, and bytes of each.
DEEPEST, MOST_FILES, LARGEST = 8, 100, 2**22
_WILD = "*?["


class IncludedFiles:
    """Read what the files of one configuration include; FormatError names what is not read."""

    def __init__(self) -> None:
        self._left = MOST_FILES

    def read(self, name: str, source: str, depth: int) -> list[tuple[str, str]]:
        """Return text and name of each file that `name` in the file `source` means.

        Wildcards stand in its last part alone.
        """
        if depth >= DEEPEST:
            raise FormatError(f"{source}: files are included in each other more than {DEEPEST} deep")
        path = Path(name)
        wild = any(each in path.name for each in _WILD)
        outside = path.is_absolute() or not path.name or name.startswith("~") or ".." in path.parts
        if outside or "**" in name or any(each in part for part in path.parts[:-1] for each in _WILD):
            raise FormatError(f"{source}: includes {name[:60]!r}; only files beside it or in folders there are read")
        folder = Path(source).parent / path.parent
        found = []
        for file in sorted(folder.glob(path.name)) if wild else [folder / path.name]:
            self._left -= 1
            if self._left < 0:
                raise FormatError(f"{source}: more than {MOST_FILES} files are included")
            found.append((read_text(file, "a configuration", LARGEST), str(file)))
        return found
