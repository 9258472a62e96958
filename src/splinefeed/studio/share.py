"""Settings as a TOML file that people can keep, read and send, and back."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.studio.settings import complete

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Longest text that is read.
LONGEST = 6_000_000


def to_toml(settings: Mapping[str, Any]) -> str:
    """The text of a file with all settings; a file of the user is named, not carried along."""
    lines = ["# splinefeed studio: drop this file on the page to have these settings again"]
    return "\n".join([*lines, *_table(complete(settings), "")]) + "\n"


def from_toml(text: str) -> dict[str, Any]:
    """The settings in the text of a file; FormatError for what is no TOML, SettingsError for what are no settings."""
    if len(text) > LONGEST:
        raise FormatError(f"settings have {len(text)} characters; at most {LONGEST} are read")
    try:
        return complete(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(f"settings: are no TOML: {error}") from None


def _table(values: Mapping[str, Any], place: str) -> Iterator[str]:
    """Plain values first, then tables, as TOML wants them."""
    for name, value in values.items():
        if value is not None and not isinstance(value, Mapping):
            yield f"{_key(name)} = {_quoted(value)}"
    for name, value in values.items():
        if isinstance(value, Mapping):
            inner = f"{place}{_key(name)}"
            yield from ("", f"[{inner}]")
            yield from _table(value, f"{inner}.")


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _quoted(name)


def _quoted(value: object) -> str:
    """JSON's texts, numbers and lists are TOML's, but for DEL, which JSON lets stand."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
