"""What a URDF says of a robot: its links with their inertia, and the joints between them; nothing is computed here.

Lengths are in m and masses in kg, as in the file [1]_. Version 1.2 of the schema [2]_ adds acceleration, deceleration
and jerk to <limit>.

References
----------
.. [1] wiki.ros.org/urdf/XML
.. [2] urdfdom, the URDF schema.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from splinefeed.errors import FormatError, InputError, nearest
from splinefeed.files import markup
from splinefeed.files.source import read_bytes
from splinefeed.numbers import finite

#: Largest file, bytes; most links of a robot; most elements, and how deep they may be nested.
MAX_BYTES, MAX_LINKS, MAX_ELEMENTS, MAX_DEPTH = 16 * 2**20, 1000, 100_000, 32
#: Longest text of an attribute, letters.
MAX_TEXT = 500
#: Kinds of joints: those that move, and those that do not.
MOVING, FIXED = ("revolute", "continuous", "prismatic"), "fixed"

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class LinkInertia:
    """Mass, kg, of a link; the frame of its inertia in the link's, m and rad; ixx, ixy, ixz, iyy, iyz, izz, kg m^2."""

    mass: float
    xyz: Vector
    rpy: Vector
    moments: tuple[float, ...]


@dataclass(frozen=True)
class JointDescription:
    """A joint as its element says.

    Parameters
    ----------
    name, kind, parent, child : str
        Of the joint, its type, and its links.
    xyz, rpy : tuple of float
        Where it is in its parent, m and rad.
    axis : tuple of float
        Its direction, in its own frame.
    limits : mapping of str to float
        Of lower, upper, velocity, effort, acceleration, deceleration and jerk those that are there; rad or m, s, N m or
        N.
    mimic : bool
        Whether it follows another joint.
    line : int
        Of the file.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: Vector
    rpy: Vector
    axis: Vector
    limits: Mapping[str, float]
    mimic: bool
    line: int


@dataclass(frozen=True)
class Description:
    """A robot as its URDF says.

    Parameters
    ----------
    name : str
        Of the robot.
    links : mapping of str to LinkInertia or None
        The inertia of each link, None where the file has none.
    shown : frozenset of str
        Links that have a shape but no inertia: likely bodies whose mass the file leaves out.
    joints : mapping of str to JointDescription
        By name.
    file : str
        For messages.
    """

    name: str
    links: Mapping[str, LinkInertia | None]
    shown: frozenset[str]
    joints: Mapping[str, JointDescription]
    file: str

    def joints_to(self, tip: str | None, base: str | None) -> tuple[list[JointDescription], str]:
        """Find the joints from one link to another.

        Parameters
        ----------
        tip : str or None
            The last link; None for the only end.
        base : str or None
            The first link; None for the root.

        Returns
        -------
        joints : list of JointDescription
            From `base` to `tip`.
        tip : str
            The last link.

        Raises
        ------
        FormatError
            For several ends without `tip`, a link that is not there, and a tip that does not hang on `base`.
        """
        above = {joint.child: joint for joint in self.joints.values()}
        if tip is None:
            ends = sorted(set(self.links) - {joint.parent for joint in self.joints.values()})
            if len(ends) != 1:
                moved = {end: sum(each.kind != FIXED for each in self._above(end, base, above)) for end in ends}
                ends.sort(key=lambda end: -moved[end])
                said = ", ".join(f"{end} ({moved[end]} joints)" for end in ends[:8])
                raise FormatError(f"{self.file}: the robot has {len(ends)} ends; name one as tip: {said}")
            tip = ends[0]
        for link in (tip, *([] if base is None else [base])):
            if link not in self.links:
                raise FormatError(f"{self.file}: there is no link {link!r}; {nearest(link, self.links)}")
        found = self._above(tip, base, above)
        if base is not None and (found[-1].parent if found else tip) != base:
            raise FormatError(f"{self.file}: link {tip!r} does not hang on link {base!r}; name another base")
        return found[::-1], tip

    @staticmethod
    def _above(link: str, base: str | None, above: Mapping[str, JointDescription]) -> list[JointDescription]:
        """The joints from a link up to `base`, or to the root."""
        found: list[JointDescription] = []
        while link != base and link in above:
            found.append(above[link])
            link = above[link].parent
        return found


@dataclass
class _UrdfElement:
    tag: str
    attributes: dict[str, str]
    line: int
    children: list[_UrdfElement] = field(default_factory=list)

    def one(self, tag: str) -> _UrdfElement | None:
        return next((child for child in self.children if child.tag == tag), None)


def read_description(source: str | Path) -> Description:
    """Read a robot from a URDF file, or from the text of one.

    Parameters
    ----------
    source : str or Path
        The file, or the text, which begins with <.

    Returns
    -------
    Description
        Its links and joints.

    Raises
    ------
    FormatError
        With file, line and mend: for what is not a URDF, for xacro that is not expanded, for entities, too many links,
        unknown kinds of joints, and links that do not form one tree.
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        name, content = "URDF", source.encode("utf-8")
    else:
        name = str(source)
        content = read_bytes(source, MAX_BYTES + 1)
    try:
        return _description(content, name)
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None


def _tree(content: bytes) -> _UrdfElement:
    """The root element; InputError for what is not XML, has entities of its own, or is too large or too deep."""
    if len(content) > MAX_BYTES:
        raise InputError(f"is larger than {MAX_BYTES // 2**20} MB; a URDF names its meshes and does not hold them")
    parser = markup.parser()
    roots: list[_UrdfElement] = []
    stack: list[_UrdfElement] = []
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS or len(stack) >= MAX_DEPTH:
            raise InputError(
                f"line {parser.CurrentLineNumber}: more than {MAX_ELEMENTS} elements, or more than {MAX_DEPTH} deep"
            )
        if tag.startswith("xacro:"):
            raise InputError(f"line {parser.CurrentLineNumber}: <{tag}>: expand it first: xacro FILE > robot.urdf")
        if any(len(value) > MAX_TEXT for value in attributes.values()):
            raise InputError(f"line {parser.CurrentLineNumber}: <{tag[:40]}>: a text has more than {MAX_TEXT} letters")
        element = _UrdfElement(tag, attributes, parser.CurrentLineNumber)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def entity(*_: object) -> None:
        raise InputError(f"line {parser.CurrentLineNumber}: entities are not read; write out what they stand for")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.EntityDeclHandler = entity
    markup.parse(parser, content, "URDF")
    return roots[0]


def _description(content: bytes, file: str) -> Description:
    root = _tree(content)
    if root.tag != "robot":
        raise InputError(f"line {root.line}: the root is <{root.tag}>; expected <robot>")
    links: dict[str, LinkInertia | None] = {}
    joints: dict[str, JointDescription] = {}
    shown = set()
    for element in root.children:  # <gazebo>, <material>, <transmission> and the like say nothing of motion
        if element.tag == "link":
            name = _name(element)
            if name in links:
                raise InputError(f"line {element.line}: link {name!r} is there twice; rename one")
            if len(links) == MAX_LINKS:
                raise InputError(f"line {element.line}: more than {MAX_LINKS} links; that is no serial arm")
            links[name] = _inertia(element, f"link {name!r}")
            if links[name] is None and (element.one("visual") or element.one("collision")):
                shown.add(name)
        elif element.tag == "joint":
            joint = _joint(element)
            if joint.name in joints:
                raise InputError(f"line {element.line}: joint {joint.name!r} is there twice; rename one")
            joints[joint.name] = joint
    if not links:
        raise InputError("there is no <link>; is it a URDF?")
    _one_tree(links, joints)
    return Description(root.attributes.get("name", ""), links, frozenset(shown), joints, file)


def _one_tree(links: Mapping[str, object], joints: Mapping[str, JointDescription]) -> None:
    """InputError where a joint names no link, a link hangs on two joints, or there is a loop or a second root."""
    above: dict[str, JointDescription] = {}
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in links:
                raise InputError(f"line {joint.line}: joint {joint.name!r} names link {link!r}; {nearest(link, links)}")
        if joint.child in above:
            raise InputError(
                f"line {joint.line}: link {joint.child!r} hangs on {above[joint.child].name!r} and on {joint.name!r}; "
                "a closed loop is no serial arm: take one of them out"
            )
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        raise InputError(f"links {', '.join(map(repr, roots[:8]))} hang on no joint; connect all but one of them")
    reached, waiting = 0, roots
    below: dict[str, list[str]] = {}
    for joint in joints.values():
        below.setdefault(joint.parent, []).append(joint.child)
    while waiting:
        reached += 1
        waiting.extend(below.get(waiting.pop(), []))
    if reached < len(links):
        raise InputError("links hang on each other in a loop; a closed loop is no serial arm: open it at one joint")


def _joint(element: _UrdfElement) -> JointDescription:
    name, kind = _name(element), element.attributes.get("type", "")
    what = f"joint {name!r}"
    if kind not in (*MOVING, FIXED, "floating", "planar"):
        raise InputError(f"line {element.line}: {what} has type {kind!r}; {nearest(kind, (*MOVING, FIXED))}")
    ends = []
    for tag in ("parent", "child"):
        end = element.one(tag)
        if end is None or "link" not in end.attributes:
            raise InputError(f'line {element.line}: {what} has no {tag}; write <{tag} link="..."/>')
        ends.append(end.attributes["link"])
    xyz, rpy = _origin(element, what)
    axis = (1.0, 0.0, 0.0)
    own = element.one("axis")
    if own is not None and kind != FIXED:
        axis = _vector(own, "xyz", what, axis)
        if not math.hypot(*axis) > 0.0:
            raise InputError(f"line {own.line}: the axis of {what} is 0 0 0; give its direction")
    limit = element.one("limit")
    known = ("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk")
    limits = {} if limit is None else {key: _number(limit, key, what) for key in known if key in limit.attributes}
    return JointDescription(
        name, kind, ends[0], ends[1], xyz, rpy, axis, limits, element.one("mimic") is not None, element.line
    )


def _inertia(element: _UrdfElement, what: str) -> LinkInertia | None:
    own = element.one("inertial")
    if own is None:
        return None
    mass, matrix = own.one("mass"), own.one("inertia")
    if mass is None or matrix is None:
        raise InputError(f"line {own.line}: <inertial> of {what} lacks <mass> or <inertia>; give both, or take it out")
    kilograms = _number(mass, "value", what)
    if kilograms < 0.0:
        raise InputError(f"line {mass.line}: the mass of {what} is {kilograms:g} kg; it must not be negative")
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    moments = tuple(_number(matrix, key, what) if key in matrix.attributes or key[1] == key[2] else 0.0 for key in keys)
    xyz, rpy = _origin(own, what)
    return LinkInertia(kilograms, xyz, rpy, moments)


def _name(element: _UrdfElement) -> str:
    name = element.attributes.get("name", "")
    if not name:
        raise InputError(f"line {element.line}: <{element.tag}> has no name")
    return name


def _origin(element: _UrdfElement, what: str) -> tuple[Vector, Vector]:
    own = element.one("origin")
    zero = (0.0, 0.0, 0.0)
    return (zero, zero) if own is None else (_vector(own, "xyz", what, zero), _vector(own, "rpy", what, zero))


def _number(element: _UrdfElement, key: str, what: str) -> float:
    return _numbers(element, key, what, 1)[0]


def _vector(element: _UrdfElement, key: str, what: str, otherwise: Vector) -> Vector:
    if key not in element.attributes:
        return otherwise
    x, y, z = _numbers(element, key, what, 3)
    return x, y, z


def _numbers(element: _UrdfElement, key: str, what: str, count: int) -> list[float]:
    text = element.attributes.get(key, "")
    try:
        values = [finite(word) for word in text.split()]
    except InputError:
        values = []
    if len(values) != count:
        many = "a finite number" if count == 1 else f"{count} finite numbers"
        raise InputError(f'line {element.line}: {what}: {element.tag} {key}="{text[:60]}"; expected {many}')
    return values
