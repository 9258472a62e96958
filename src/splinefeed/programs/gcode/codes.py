"""G and M codes: which groups they belong to [1]_, and what is said of those that are not read.

Codes are kept as tenths: G61.1 is 611.

References
----------
.. [1] LinuxCNC documentation, "G-Code Overview", table of modal groups.
"""

from __future__ import annotations

#: Groups of which a line may name one code. Motion also holds the codes that are refused.
GROUPS: dict[str, tuple[int, ...]] = {
    "motion": (
        *(0, 10, 20, 30, 50, 51, 52, 53, 62, 63, 310, 330, 331, 382, 383, 384, 385),
        *(730, 740, 760, 800, 810, 820, 830, 840, 850, 860, 870, 880, 890),
    ),
    "one line": (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
    "plane": (170, 180, 190, 171, 181, 191),
    "distance": (900, 910),
    "arc distance": (901, 911),
    "feed mode": (930, 940, 950),
    "units": (200, 210, 700, 710),
    "cutter compensation": (400, 410, 411, 420, 421),
    "tool length": (430, 431, 432, 434, 435, 490, 2340),
    "retract": (980, 990),
    "coordinate system": (540, 541, 550, 560, 570, 580, 590, 591, 592, 593, 1540, *range(1100, 1300, 10)),
    "path control": (610, 611, 640),
    "spindle mode": (960, 970),
    "lathe diameter": (70, 80),
}
GROUP_OF = {code: group for group, codes in GROUPS.items() for code in codes}

M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60, 99),
    "spindle": (3, 4, 5, 19, 70, 71, 72, 73),  # M70 to M73, as in LinuxCNC
    "tool change": (6, 61),
    "override": (48, 49),
}
M_GROUP_OF = {code: group for group, codes in M_GROUPS.items() for code in codes}

#: What the codes of a plane and of distances do: what of the state they set, and to what.
MODES = {
    **{code: ("plane", code // 10) for code in (170, 180, 190)},
    900: ("relative", False), 910: ("relative", True),
    901: ("absolute_centres", True), 911: ("absolute_centres", False),
}  # fmt: skip
#: What can be left out if the user says so with `repair`: probing, and cutter compensation.
PROBES, COMPENSATION = (310, 382, 383, 384, 385), (410, 411, 420, 421)

#: What cannot be a path, or not without the machine: what it is, and what to do.
REFUSED: dict[int, str] = {
    **dict.fromkeys(PROBES, "a probe move: only the machine knows where it ends; leave it out"),
    **dict.fromkeys(
        COMPENSATION,
        "cutter compensation, which needs the tool's radius; give a tool table, or write the compensated path (G40)",
    ),
    650: "a macro call, which is not supported; write plain lines",
    660: "a modal macro call, which is not supported; write plain lines",
    680: "a turned coordinate system; write the turned coordinates",
    510: "scaling or mirroring; write the scaled coordinates",
    160: "polar coordinates; write X and Y",
    70: "lathe diameter mode; write radii (G8)",
    **dict.fromkeys((171, 181, 191), "a plane of U, V, W, in which there are no arcs; choose G17, G18 or G19"),
    **dict.fromkeys((760, 870, 880), "a canned cycle that is not supported; let the CAM system write its moves"),
}

#: Codes that change nothing that a path knows.
WITHOUT_EFFECT = frozenset((80, 150, 400, 490, 500, 690, 800, 960, 970, 980, 990))

#: M codes for which LinuxCNC does not wait until the tool stops: outputs in step with motion, and overrides.
ON_THE_MOVE = frozenset((48, 49, 50, 51, 52, 53, 62, 63, 67))
ENDS = frozenset((2, 30))
SUBPROGRAMS = frozenset((96, 97, 98, 99))


def g_name(code: int) -> str:
    """G61.1 for 611."""
    return f"G{code // 10}" + (f".{code % 10}" if code % 10 else "")
