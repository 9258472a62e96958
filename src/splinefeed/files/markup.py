"""What every reader of XML refuses of a DOCTYPE, whose few lines may ask for any amount of work."""

from __future__ import annotations

from xml.parsers import expat

from splinefeed.errors import InputError

#: Most attributes that a DOCTYPE may declare: expat looks at each of them at every element.
MAX_DECLARED = 100


def parser() -> expat.XMLParserType:
    """A parser of XML that refuses, by InputError with the line, what multiplies a text: attributes by default."""
    made = expat.ParserCreate()
    count = 0

    def declared(element: str, name: str, kind: str, value: str | None, required: bool) -> None:
        nonlocal count
        count += 1
        if value is not None:
            what = f"gives every <{element[:40]}> the attribute {name[:40]!r}"
        elif count > MAX_DECLARED:
            what = f"declares more than {MAX_DECLARED} attributes"
        else:
            return
        raise InputError(f"line {made.CurrentLineNumber}: {what}; save it without a DOCTYPE")

    made.AttlistDeclHandler = declared
    return made
