"""Pages in a browser: how soon the report of a long run is there, the studio, and a new plan while a slider moves."""

from __future__ import annotations

import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.tables import Column, Headline, Report, Table

#: A motion of ten million ticks.
LONG_RUN = (
    "butterfly --feed 0.38mm/s --period 0.1ms --axis-acceleration 500 --axis-jerk 20000 --strategy look-ahead "
    "--machine xytheta"
)
#: Targets: s, bytes, s and s.
OPEN, SIZE, PAINT, REPLAN = 3.0, 8e6, 1.0, 0.3
OPENINGS, PLANS = 5, 30
#: Nobody waits longer, ms.
PATIENCE = 600_000
QUIET = "--no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync"
PAINTED = "performance.getEntriesByName('first-contentful-paint')[0].startTime"
#: From the event of a slider to the frame after its numbers and its picture are drawn, ms, one after the other.
SLIDE = """async (count) => {
  const slider = document.querySelector('[aria-label="feed, slider"]');
  const answer = () => new Promise((resolve) => new MutationObserver((_, own) => { own.disconnect(); resolve(); })
    .observe(document.body, { attributeFilter: ["data-took"] }));
  const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const took = [];
  for (let k = 0; k < count; k++) {
    slider.value = String(Number(slider.value) - 1);
    const begun = performance.now(), answered = answer();
    slider.dispatchEvent(new Event("input"));
    await answered; await frame(); await frame();
    took.push(performance.now() - begun);
    await new Promise((resolve) => setTimeout(resolve, 1500)); // the plan at rest has come
  }
  return took; }"""


def measure() -> Report:
    """Seconds until a page is there, in Chromium on this machine."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play, tempfile.TemporaryDirectory(prefix="splinefeed-bench-") as folder:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET.split())
        size, first, whole = _report(browser, Path(folder))
        paints, plans = _studio(browser, folder)
        browser.close()
    rows = (
        (f"report of ten million ticks, {size / 1e6:.1f} MB: first screen", *_of(first), OPEN),
        ("all of its figures drawn", *_of(whole), OPEN),
        ("studio on loopback: first paint", *_of(paints), PAINT),
        ("studio: slider moved, new numbers and path on the screen", *_of(plans), REPLAN),
    )
    columns = (
        Column("what"),
        Column("times", "d"),
        Column("median, s", ".2f"),
        Column("slowest, s", ".2f"),
        Column("target, s", "g"),
    )
    notes = ("Chromium without a graphics card; a new context each time, the library compiled again.",)
    heads = (
        Headline(
            "report of ten million ticks opens",
            f"{statistics.median(first):.2f} s, all figures {statistics.median(whole):.2f} s, {size / 1e6:.1f} MB",
            f"{OPEN:g} s, {SIZE / 1e6:g} MB",
            statistics.median(whole) < OPEN and size < SIZE,
        ),
        Headline(
            "re-plan of the butterfly in the studio, slider to screen",
            f"{1e3 * statistics.median(plans):.0f} ms",
            f"{1e3 * REPLAN:g} ms",
            statistics.median(plans) < REPLAN,
        ),
    )
    return Report((Table("Until a page is there.", columns, rows, notes),), heads)


def _of(times: list[float]) -> tuple[int, float, float]:
    return len(times), statistics.median(times), max(times)


def _report(browser: Any, folder: Path) -> tuple[int, list[float], list[float]]:
    command = [sys.executable, "-m", "splinefeed", "run", *LONG_RUN.split(), "-o", str(folder / "long")]
    subprocess.run(command, check=True, capture_output=True)
    file = folder / "long" / "report.html"
    first, whole = [], []
    for _ in range(OPENINGS):
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        page = context.new_page()
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready=yes]", state="attached", timeout=PATIENCE)
        first.append(1e-3 * page.evaluate(PAINTED))
        whole.append(1e-3 * page.evaluate("performance.getEntriesByName('ready')[0].startTime"))
        context.close()
    return file.stat().st_size, first, whole


def _studio(browser: Any, folder: str) -> tuple[list[float], list[float]]:
    command = [sys.executable, "-m", "splinefeed", "studio", "--no-browser", "--no-history"]
    studio = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        assert studio.stdout is not None
        address = next(word for word in studio.stdout.readline().split() if word.startswith("http"))
        paints = []
        for _ in range(OPENINGS):
            page = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
            page.goto(address)
            page.wait_for_selector("body[data-shown=final]", timeout=PATIENCE)
            page.wait_for_selector(".job", state="detached", timeout=PATIENCE)
            paints.append(1e-3 * page.evaluate(PAINTED))
        page.evaluate(SLIDE, 3)
        return paints, [1e-3 * each for each in page.evaluate(SLIDE, PLANS)]
    finally:
        studio.send_signal(signal.SIGINT)
        studio.wait(60)
