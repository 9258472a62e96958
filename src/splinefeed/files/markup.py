"""XML of strangers, element by element: what a DOCTYPE may not ask for, and faults with their place."""

from __future__ import annotations

from xml.parsers import expat

from splinefeed.errors import InputError
from splinefeed.files.source import in_brief

#: Most attributes that a DOCTYPE may declare: expat looks at each of them at every element.
MAX_DECLARED = 100


def parser() -> expat.XMLParserType:
    """Make a parser of XML that refuses what multiplies a text.

    Returns
    -------
    XMLParserType
        By InputError with the line it refuses attributes by default, and more than MAX_DECLARED declarations.
    """
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


def parse(parser: expat.XMLParserType, content: bytes, expected: str) -> None:
    """Give a document to the handlers of a parser.

    Parameters
    ----------
    parser : XMLParserType
        With its handlers.
    content : bytes
        The document.
    expected : str
        What it should be, for the message.

    Raises
    ------
    InputError
        With the place of what is no XML, and for an encoding that is not known.
    """
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        place, said = f"line {error.lineno}, column {error.offset + 1}", expat.ErrorString(error.code)
        raise InputError(f"{place}: {said}; expected {expected}, is the file complete?") from None
    except InputError:
        raise
    except (ValueError, LookupError) as error:  # codecs are Python's, and some are none of texts
        raise InputError(f"its encoding is not known: {in_brief(error)}") from None
