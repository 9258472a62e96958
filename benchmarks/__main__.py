"""Run benchmarks by name, print their tables, and write them into results.json and docs/benchmarks.md."""

from __future__ import annotations

import argparse
import datetime
import platform
import shutil
import subprocess
import sys
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from benchmarks.peers import below
from benchmarks.tables import Headline, Report, read_results, summary, write_into, write_results

NAMES = (
    "ticks",
    "points",
    "arc",
    "online",
    "start",
    "stream",
    "long",
    "servo",
    "methods",
    "plan",
    "planners",
    "curves",
    "suite",
    "rows",
    "tool",
    "tool_controller",
    "robots",
    "smooth",
    "paths",
    "cad",
    "drawings",
    "gcode",
    "sweeps",
    "live",
    "controller",
    "linuxcnc_motion",
    "linuxcnc_reactions",
    "linuxcnc_kinematics",
    "pages",
)
RESULTS = Path(__file__).with_name("results.json")
ROOT = Path(__file__).parents[1]
#: Have markers for the tables that they show.
PAGES = (ROOT / "docs" / "benchmarks.md", *sorted((ROOT / "docs" / "benchmarks").glob("*.md")))
PACKAGES = (
    "splinefeed",
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "h5py",
    "geomdl",
    "splipy",
    "nurbspy",
    "cadquery-ocp-novtk",
    "rhino3dm",
    "ezdxf",
    "svgelements",
    "casadi",
    "copp-py",
    "ruckig",
    "toppra",
    "pin",
    "example-robot-data",
    "pylibfranka",
    "distributed",
)
#: Programs beside the packages, and the command that prints the version of each.
PROGRAMS = {"gcc": ("gcc", "-dumpfullversion"), "linuxcnc": ("dpkg-query", "-W", "-f=${Version}", "linuxcnc-uspace")}


def main() -> int:
    """Measure what was asked for, all by default; 2 for a name that is none."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one or more of {', '.join(NAMES)}; all by default")
    parser.add_argument("--pages", action="store_true", help="measure nothing: write the pages anew from results.json")
    arguments = parser.parse_args()
    names = arguments.names or NAMES
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        parser.error(f"no benchmark is called {unknown[0]!r}; there are {', '.join(NAMES)}")
    if arguments.pages:
        for name, entry in read_results(RESULTS).items():
            _write_pages(name, page_text(name, entry))
    else:
        for name in names:
            print(f"measuring {name} ...", file=sys.stderr, flush=True)
            report = import_module(f"benchmarks.{name}").measure()
            entry = {**surroundings(), **report.as_dict()}
            text = page_text(name, entry)
            print(f"## {name}\n\n{text}\n", flush=True)
            write_results(RESULTS, name, entry)
            _write_pages(name, text)
    found = headlines()
    print(f"## speed\n\n{found}", flush=True)
    _write_pages("speed", found)
    return 0


def page_text(name: str, entry: dict[str, Any]) -> str:
    """What a page shows of one entry of results.json."""
    return f"{Report.from_dict(entry).markdown()}\n\n{below(name, entry)}"


def _write_pages(name: str, text: str) -> None:
    for page in PAGES:
        write_into(page, name, text)


def headlines() -> str:
    """The summary of all benchmarks in results.json, in their order, as Markdown, and where and when they ran."""
    results = read_results(RESULTS)
    entries = [results[name] for name in NAMES if name in results]
    table = summary(Headline(**line) for entry in entries for line in entry["headlines"])
    where = sorted({f"{entry['processor']}, Python {entry['versions']['python']}" for entry in entries})
    dates = sorted(entry["date"][:10] for entry in entries)
    when = dates[0] if dates[0] == dates[-1] else f"{dates[0]} to {dates[-1]}"
    return f"{table.markdown()}\n\nMeasured {when} on {'; '.join(where)}."


def surroundings() -> dict[str, object]:
    """When and on what a benchmark ran."""
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    for program, words in PROGRAMS.items():
        if shutil.which(words[0]):
            told = subprocess.run(words, capture_output=True, text=True)
            if told.returncode == 0 and told.stdout.strip():
                versions[program] = told.stdout.split()[0]
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {"date": now, "processor": _processor(), "system": platform.system(), "versions": versions}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


if __name__ == "__main__":
    sys.exit(main())
