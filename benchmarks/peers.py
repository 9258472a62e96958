"""What stands below each group of tables: what its peers do that splinefeed does not, and what it was measured with."""

from __future__ import annotations

from typing import Any

#: Names in `versions` that every line ends with, and what they are called there.
ALWAYS = {"python": "Python", "splinefeed": "splinefeed", "numpy": "NumPy", "numba": "Numba"}
#: What else a group was measured with: names in `versions`, and what they are called.
PACKAGES: dict[str, dict[str, str]] = {
    "ticks": {"gcc": "gcc"},
    "points": {
        "scipy": "SciPy",
        "nurbspy": "nurbspy",
        "splipy": "splipy",
        "cadquery-ocp-novtk": "OCCT (cadquery-ocp-novtk)",
        "geomdl": "geomdl",
    },
    "arc": {"scipy": "SciPy"},
    "planners": {"copp-py": "copp-py", "casadi": "CasADi", "toppra": "TOPP-RA", "ruckig": "Ruckig"},
    "suite": {"copp-py": "copp-py", "toppra": "TOPP-RA", "ruckig": "Ruckig"},
    "cad": {"cadquery-ocp-novtk": "OCCT (cadquery-ocp-novtk)", "rhino3dm": "rhino3dm"},
    "drawings": {"ezdxf": "ezdxf", "svgelements": "svgelements"},
    "controller": {"linuxcnc": "LinuxCNC"},
    "robots": {"pin": "pinocchio", "example-robot-data": "example-robot-data", "pylibfranka": "pylibfranka"},
    "smooth": {"linuxcnc": "LinuxCNC"},
    "live": {"linuxcnc": "LinuxCNC"},
    "sweeps": {"distributed": "Dask"},
    "stream": {"h5py": "h5py"},
    "long": {"h5py": "h5py"},
}
#: Where a peer can do more, or is the better choice.
MORE: dict[str, str] = {
    "ticks": (
        "What C has that splinefeed has not: it starts at once, without a compiler on the machine, and runs inside a "
        "real-time kernel; a loop in Numba is compiled once for each machine and runs where Python runs."
    ),
    "points": (
        "What they do that splinefeed does not: SciPy has tensor products in any number of dimensions; geomdl, splipy "
        "and nurbspy have surfaces (geomdl and splipy volumes too), and geomdl needs no compiled code at all; OCCT is "
        "a whole CAD kernel, with solids, intersections and offsets. splinefeed has curves only."
    ),
    "controller": (
        "What LinuxCNC does that splinefeed does not: it runs whole programs with tool changes, probing, threading and "
        "rigid tapping, takes jogging and an adaptive feed in real time, knows kinematics of robots and nine axes, and "
        "plans inside the real-time kernel; ours is made by Python outside of it and waits in a buffer."
    ),
    "cad": (
        "What they do that splinefeed does not: OCCT and rhino3dm read surfaces, solids and meshes, and write them; "
        "ours keeps the curves and edges only. Where the ratio is above 1 ours is slower than the library alone."
    ),
    "drawings": (
        "What they do that splinefeed does not: ezdxf keeps text, hatches, dimensions, layouts and all else of a "
        "drawing, and writes it back; svgelements keeps colours, strokes and text. Ours keeps curves only. Where the "
        "ratio is above 1 ours is slower than the library alone."
    ),
    "gcode": "There is no peer in this table: a plain read of the bytes is the floor, not a reader.",
}


def below(name: str, entry: dict[str, Any]) -> str:
    """The lines below the tables of one group, from its entry in results.json."""
    versions = entry["versions"]
    used = {**PACKAGES.get(name, {}), **ALWAYS}
    told = ", ".join(f"{title} {versions[each]}" for each, title in used.items() if each in versions)
    measured = f"Measured {entry['date'][:10]} on {entry['processor']}, {entry['system']}: {told}."
    return "\n\n".join(filter(None, (MORE.get(name), measured)))
