"""A motion of an arm as a JSON file, which `splinefeed run FILE --robot URDF` plans: waypoints, or a curve.

    {"tip": "tool0", "limits": {"acceleration": 15, "jerk": 500}, "payload": 2.0,
     "waypoints": [[0, -1.6, 1.9, -1.9, -1.57, 0], [0.4, -1.2, 1.5, -1.9, -1.57, 0.3]]}

Beside waypoints "near", "duration" and "times" (null where any will do) are what `arm.through` takes. In place of
waypoints "along" has what `arm.along` takes; its curve is a file of x, y, z, mm, or a NURBS curve itself:

    "along": {"curve": "seam.json", "start": [0, -1.6, 1.9, -1.9, -1.57, 0], "feed": 200}
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

from splinefeed.curves.curve import NurbsCurve
from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.files.json_values import Check, anything, fields, number, or_none, parse, text, truth
from splinefeed.files.source import read_text
from splinefeed.formats import registry
from splinefeed.kinematics import JointPath
from splinefeed.paths.path import Path
from splinefeed.paths.track import Track
from splinefeed.records import Limits
from splinefeed.robots.arm import Arm, robot

#: Keys of the file: what `sf.robot` takes, what goes with waypoints, and what is given along a curve, with its keys.
ARM: dict[str, Check] = {
    **dict.fromkeys(("tip", "base"), or_none(text)),
    **dict.fromkeys(("limits", "payload", "friction", "gravity"), anything),
    "torque": truth,
}
THROUGH: dict[str, Check] = {"near": anything, "duration": or_none(number), "times": anything}
ALONG: dict[str, Check] = {
    **dict.fromkeys(("curve", "start", "orientation", "hold"), anything),
    "feed": or_none(number),
}
CURVE = dict.fromkeys(("degree", "knots", "control_points", "weights"), anything)
MOTIONS = {"waypoints": anything, "along": anything}
KEYS = {**ARM, **MOTIONS, **THROUGH, "name": or_none(text)}
#: Largest file, bytes.
MAX_BYTES = 64 * 2**20


def read_motion(
    file: str | os.PathLike[str], urdf: str | os.PathLike[str], *, feed: float | None = None
) -> tuple[Arm, Track, Limits]:
    """Read a motion of an arm from its file and a URDF.

    Parameters
    ----------
    file : str or PathLike
        The motion, JSON; files that it names lie beside it.
    urdf : str or PathLike
        Of the robot.
    feed : float, optional
        Along a curve of the tip, mm/s.

    Returns
    -------
    arm : Arm
        The arm.
    path : Track
        Of its joints, rad and mm.
    limits : Limits
        Of the joints.

    Raises
    ------
    FormatError
        Naming file, key and mend; and all that `robot`, `through` and `along` raise.
    InputError
        For a feed beside waypoints.
    """
    name = os.fspath(file)
    said = fields(parse(read_text(name, "a motion of an arm", MAX_BYTES), name), name, KEYS)
    motion = [key for key in MOTIONS if key in said]
    if len(motion) != 1:
        raise FormatError(f"{name}: has {' and '.join(motion) or 'no motion'}; give either waypoints or along")
    how = {key: said[key] for key in ARM if key in said}
    if isinstance(how.get("limits"), str):
        how["limits"] = FilePath(name).parent / how["limits"]
    try:
        arm = robot(os.fspath(urdf), **how)
    except SplinefeedError as error:
        if str(error).startswith((os.fspath(urdf), str(how.get("limits")))):
            raise
        raise type(error)(f"{name}: {error}") from None
    title = said.get("name") or FilePath(name).stem
    try:
        path: Track
        if "waypoints" in said:
            if feed is not None:
                raise InputError("waypoints: a path of joints has no feed in mm/s; leave --feed out")
            path = arm.through(said["waypoints"], name=title, **{key: said[key] for key in THROUGH if key in said})
        else:
            for key in (each for each in THROUGH if each in said):
                raise InputError(f"{key}: is of waypoints; leave it out beside along")
            path = _along(arm, said["along"], name, title, feed)
    except SplinefeedError as error:
        raise type(error)(f"{name}: {error}") from None
    return arm, path, arm.limits


def is_motion(file: str | os.PathLike[str]) -> bool:
    """Tell whether a JSON file is the motion of an arm, and not curves.

    Parameters
    ----------
    file : str or PathLike
        To be looked at.

    Returns
    -------
    bool
        True for the motion of an arm.
    """
    try:
        said = parse(read_text(file, "a motion of an arm", MAX_BYTES), file)
        return isinstance(said, dict) and any(key in said for key in MOTIONS)
    except FormatError:
        return False


def _along(arm: Arm, said: Any, name: str, title: str, feed: float | None) -> JointPath:
    said = fields(said, "along", ALONG, ("curve", "start"))
    curve = said["curve"]
    if isinstance(curve, str):
        curve = registry.read(FilePath(name).parent / curve)
    elif isinstance(curve, Mapping):
        curve = NurbsCurve(**fields(curve, "along: curve", CURVE, ("degree", "knots", "control_points")))
    else:
        raise InputError("along: curve is neither the name of a file nor a table of degree, knots and control_points")
    tip = Path([curve], name=title) if isinstance(curve, NurbsCurve) else curve.named(title)
    how = {key: said[key] for key in ("orientation", "hold", "feed") if key in said}
    if feed is not None:
        how["feed"] = feed
    return arm.along(tip, start=said["start"], **how)
