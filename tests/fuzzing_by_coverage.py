"""`python tests/fuzzing_by_coverage.py KIND FOLDER [options of libFuzzer]`: what Atheris finds must not surprise us."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["splinefeed.formats"], enable_loader_override=False):
    pass

import fuzzing
from splinefeed.errors import SplinefeedError


def main() -> None:
    """Run libFuzzer over one reader; it ends with an error, and the input kept, at the first exception not ours."""
    kind, folder = sys.argv[1], Path(sys.argv[2])
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    for i, content in enumerate(fuzzing.seeds(kind, folder)):
        (corpus / f"seed{i}").write_bytes(content[:8000])
    read, file = fuzzing.reader(kind), folder / "input.bin"

    def one(data: bytes) -> None:
        file.write_bytes(data or b"0")
        with contextlib.suppress(SplinefeedError):
            read(file, len(data) % 2 == 0)

    atheris.Setup([sys.argv[0], *sys.argv[3:], str(corpus)], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
