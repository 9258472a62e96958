"""What an install brings: how many packages, how heavy, under which licences, and each one argued for."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution

import pytest
from packaging.requirements import Requirement

from docs_pages import ROOT

MOST_PACKAGES, MOST_MEGABYTES = 18, 300
#: SPDX identifiers under which a package may ship with a program of the MIT licence without duties but naming it.
PERMISSIVE = {
    "MIT", "MIT-CMU", "MIT-0", "BSD-2-Clause", "BSD-3-Clause", "0BSD", "Apache-2.0", "PSF-2.0", "Python-2.0", "HPND",
    "Zlib", "CC0-1.0", "Unlicense", "ISC", "LLVM-exception", "LicenseRef-Matplotlib",
}  # fmt: skip
PAGE = ROOT / "docs/licences.md"


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def closure(extra: str | None = None) -> set[str]:
    """Names of the packages that splinefeed asks for, with the extra or without, and of all that these bring here."""
    asked = [*PROJECT["dependencies"], *(PROJECT["optional-dependencies"][extra] if extra else ())]
    waiting = [(Requirement(line), frozenset({""})) for line in asked]
    done: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        wanted, extras = waiting.pop()
        if wanted.marker and not any(wanted.marker.evaluate({"extra": each}) for each in extras):
            continue
        name, brings = re.sub(r"[-_.]+", "-", wanted.name).lower(), frozenset({"", *wanted.extras})
        if (name, brings) not in done:
            done.add((name, brings))
            waiting += [(Requirement(line), brings) for line in distribution(name).requires or []]
    return {name for name, _ in done}


def megabytes(names: set[str]) -> float:
    files = [file for name in names for file in distribution(name).files or [] if file.suffix != ".pyc"]
    places = {file.locate() for file in files}
    return sum(place.stat().st_size for place in places if place.exists()) / 1e6


def test_the_core_is_small_enough():
    core = closure()
    assert len(core) <= MOST_PACKAGES, sorted(core)
    assert megabytes(core) < MOST_MEGABYTES


def test_every_dependency_has_its_line_in_the_decisions():
    text = "".join(page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs/decisions").glob("*.md")))
    asked = [*PROJECT["dependencies"], *(line for lines in PROJECT["optional-dependencies"].values() for line in lines)]
    names = {Requirement(line).name for line in asked} - {"splinefeed"}
    missing = [name for name in sorted(names) if not re.search(rf"\b{re.escape(name)}\b", text)]
    assert not missing


def rows() -> dict[str, tuple[str, str]]:
    """Package to licence and where it comes in, as the page has them."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| `")]
    return {row[0].strip("`"): (row[1], row[2]) for row in cells}


#: Extras that `make test-slow` alone installs.
LATER = [pytest.param(extra, marks=pytest.mark.slow) for extra in ("dask", "mpi")]


@pytest.mark.parametrize("extra", [None, "plots", "parquet", "sim", "studio", "cad", *LATER])
def test_licences_of_what_an_install_brings_are_told(extra):
    told = rows()
    try:
        names = closure(extra)
    except PackageNotFoundError as missing:
        pytest.skip(f"{missing} is not installed")
    assert not sorted(names - set(told)), "add them to docs/licences.md"


def test_the_core_and_what_it_brings_is_permissive():
    told = rows()
    for name in closure():
        parts = set(re.split(r"\s+(?:AND|OR|WITH)\s+|[()]", told[name][0])) - {""}
        assert parts <= PERMISSIVE, name


def test_licences_told_are_those_that_the_packages_tell():
    """Where a package names an SPDX expression of its own, the page has the same."""
    for name, (licence, _) in rows().items():
        try:
            own = distribution(name).metadata.get("License-Expression")
        except PackageNotFoundError:
            continue
        if own:
            assert licence == own, name
