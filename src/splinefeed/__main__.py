"""Lets `python -m splinefeed` do what the command `splinefeed` does."""

from __future__ import annotations

from splinefeed.cli.main import main

if __name__ == "__main__":
    main()
