"""Settings as a TOML file that people can keep, read and send, and back."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.studio.settings import complete

#: Longest text that is read.
LONGEST = 6_000_000


def to_toml(settings: Mapping[str, Any]) -> str:
    """The text of a file with all settings; a file of the user is named, not carried along."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("splinefeed studio: drop this file on the page to have these settings again"))
    document.update(_said(complete(settings)))
    return tomlkit.dumps(document)


def from_toml(text: str) -> dict[str, Any]:
    """The settings in the text of a file; FormatError for what is not TOML, SettingsError for what are no settings."""
    if len(text) > LONGEST:
        raise FormatError(f"settings have {len(text)} characters; at most {LONGEST} are read")
    try:
        return complete(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(f"settings: are not TOML: {error}") from None


def _said(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values without those that are None, which TOML has no word for."""
    given = {name: value for name, value in values.items() if value is not None}
    return {name: _said(value) if isinstance(value, Mapping) else value for name, value in given.items()}
