"""What a worker process has at hand: folders, a way to speak to the page, and the last runs."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from splinefeed.errors import SplinefeedError
from splinefeed.pipeline.run import Run, run
from splinefeed.studio import sources
from splinefeed.studio.settings import SettingsError, Wanted, complete, field_of, key_of, resolve
from splinefeed.workers import Mail

#: Runs that a worker keeps at hand.
KEPT = 3


@dataclass
class Bench:
    """Folders of uploads and of files made, the mail to the server, and the last runs by their settings."""

    uploads: Path
    made: Path
    mail: Mail
    runs: OrderedDict[str, tuple[Wanted, Run]] = field(default_factory=OrderedDict)

    def say(self, words: str) -> None:
        """Tell the page what is being done."""
        self.mail.tell({"kind": "progress", "words": words})

    def done(self, requested: Mapping[str, Any], *, follow: bool = True) -> tuple[Wanted, Run]:
        """The run of these settings, followed by its machine if `follow`; from the last ones where it is there."""
        key = key_of({**complete(requested), "follow": follow})
        if key not in self.runs:
            wanted = resolve(requested, self.uploads)
            self.say(f"planning {wanted.path.name}, {wanted.strategy}")
            try:
                made = run(
                    wanted.moved,
                    wanted.limits,
                    machine=wanted.machine if follow and wanted.followed else None,
                    period=wanted.period,
                    strategy=wanted.strategy,
                    method=wanted.method,
                    corrections=wanted.corrections,
                    on_progress=lambda what, done, of: self.say(f"{what}: {done} of {of} ticks"),
                )
            except SplinefeedError as error:
                raise SettingsError({field_of(error): sources.words(error, self.uploads)}) from error
            self.runs[key] = wanted, made
        self.runs.move_to_end(key)
        while len(self.runs) > KEPT:
            self.runs.popitem(last=False)
        return self.runs[key]
