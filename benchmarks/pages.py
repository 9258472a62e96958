"""Pages in a browser: the report of an hour, the studio from its command on, and a new plan while a slider moves."""

from __future__ import annotations

import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.tables import Column, Headline, Report, Table

#: A motion of an hour at 1 ms.
HOUR = "butterfly --feed 0.106mm/s --axis-acceleration 500 --axis-jerk 20000 --strategy look-ahead --machine xytheta"
#: Targets: s, bytes, s and s.
OPEN, SIZE, PICTURE, REPLAN = 3.0, 8e6, 1.5, 0.3
OPENINGS, PLANS = 5, 30
#: Nobody waits longer, ms.
PATIENCE = 600_000
QUIET = "--no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync"
PAINTED = "performance.getEntriesByName('first-contentful-paint')[0].startTime"
#: Notes when the frame after the first plan begins: what the page does then no longer keeps the picture back.
NOTE = """new MutationObserver((_, own) => {
  if (!document.body?.dataset.shown) return;
  own.disconnect();
  requestAnimationFrame(() => requestAnimationFrame(() => { window.picturedAt = Date.now(); }));
}).observe(document, { subtree: true, childList: true, attributeFilter: ["data-shown"] });"""
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
        paints, pictures, plans = _studio(browser, folder)
        browser.close()
    rows = (
        (f"report of an hour at 1 ms, {size / 1e6:.1f} MB: first screen", *_of(first), OPEN),
        ("all of its figures drawn", *_of(whole), OPEN),
        ("studio: page opened, first paint", *_of(paints), PICTURE),
        ("studio: from the command to the example planned and on the screen", *_of(pictures), PICTURE),
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
            "report of an hour at 1 ms opens",
            f"{statistics.median(first):.2f} s, all figures {statistics.median(whole):.2f} s, {size / 1e6:.1f} MB",
            f"{OPEN:g} s, {SIZE / 1e6:g} MB",
            statistics.median(whole) < OPEN and size < SIZE,
        ),
        Headline(
            "studio, from the command to the first plan on the screen",
            f"{statistics.median(pictures):.2f} s",
            f"{PICTURE:g} s",
            statistics.median(pictures) < PICTURE,
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
    command = [sys.executable, "-m", "splinefeed", "run", *HOUR.split(), "-o", str(folder / "hour")]
    subprocess.run(command, check=True, capture_output=True)
    file = folder / "hour" / "report.html"
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


def _studio(browser: Any, folder: str) -> tuple[list[float], list[float], list[float]]:
    """Seconds to the first paint of the page, to its first plan since the command, and of plans of a slider."""
    command = [sys.executable, "-m", "splinefeed", "studio", "--no-browser", "--no-history"]
    paints, pictures, plans = [], [], []
    for opening in range(OPENINGS):
        begun = time.time()
        studio = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
        try:
            assert studio.stdout is not None
            address = next(word for word in studio.stdout.readline().split() if word.startswith("http"))
            context = browser.new_context(viewport={"width": 1280, "height": 900})
            page = context.new_page()
            page.add_init_script(NOTE)
            page.goto(address)
            page.wait_for_selector("body[data-shown=final]", timeout=PATIENCE)
            paints.append(1e-3 * page.evaluate(PAINTED))
            pictures.append(1e-3 * page.evaluate("picturedAt") - begun)
            page.wait_for_selector(".job", state="detached", timeout=PATIENCE)
            if opening == OPENINGS - 1:
                page.evaluate(SLIDE, 3)
                plans = [1e-3 * each for each in page.evaluate(SLIDE, PLANS)]
            context.close()
        finally:
            studio.send_signal(signal.SIGINT)
            studio.wait(60)
    return paints, pictures, plans
