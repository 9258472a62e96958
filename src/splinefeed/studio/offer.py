"""What a page can choose from."""

from __future__ import annotations

from typing import Any


def offer() -> dict[str, Any]:
    """Shapes, strategies, methods, machines and formats by name, with what they are; and the usual settings."""
    from splinefeed.feed.planning import STRATEGIES
    from splinefeed.geometry import shapes
    from splinefeed.interpolation import registry
    from splinefeed.machine.machine import Machine
    from splinefeed.report.files import SETPOINTS
    from splinefeed.studio.downloads import PATHS
    from splinefeed.studio.settings import USUAL
    from splinefeed.studio.uploads import LARGEST

    return {
        "shapes": [{"name": name, "what": what, "example": example} for name, what, example in shapes.describe()],
        "strategies": list(STRATEGIES),
        "methods": [{"name": name, "title": registry.method(name).title} for name in registry.methods()],
        "machines": [
            {"name": each.name, "title": each.title, "axes": bool(each.axes), "control": each.control is not None}
            for each in map(Machine.load, Machine.names())
        ],
        "setpoints": list(SETPOINTS),
        "paths": list(PATHS),
        "usual": USUAL,
        "largest": LARGEST,
    }
