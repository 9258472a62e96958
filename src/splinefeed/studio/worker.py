"""What runs in a worker process of the studio: requests of pages in, answers as JSON out.

Uploads are read here, never in the server: what crashes a reader, eats memory or does not end takes a worker with it
and nothing else.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from splinefeed.workers import Answer, Handler, Mail


def open_bench(mail: Mail, uploads: str, made: str) -> Handler:
    """What answers requests with the two folders; errors are answers too, and the next request finds it sound."""
    from splinefeed.studio.bench import Bench
    from splinefeed.studio.tasks import TASKS, error_of

    bench = Bench(Path(uploads), Path(made), lambda words: mail.tell({"kind": "progress", "words": words}), mail)

    def answer(request: dict[str, Any]) -> Answer:
        try:
            found = TASKS[request["task"]](request, bench)
            entry = found.pop("entry", None)
            return {"entry": entry}, json.dumps(found, separators=(",", ":"), allow_nan=False).encode()
        except Exception as error:  # the page shows it
            return {"error": error_of(error)}, b""

    return answer
