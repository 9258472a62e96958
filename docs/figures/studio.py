"""Pictures of the studio: python docs/figures/studio.py, where Playwright and Chromium are installed."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

HERE = Path(__file__).parent
QUIET = "--no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync"
#: File, width and height of the window, scheme.
SHOTS = (("studio-light.png", 1280, 860, "light"), ("studio-dark.png", 400, 860, "dark"))
PROGRAM = HERE.parent.parent / "tests/data/cycle-time/box-op3.nc"
COMPILING = 240_000  # ms


def main() -> None:
    """Start a studio as users do, and photograph it in light and dark."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "splinefeed", "studio", "--no-browser", "--no-history"]
        studio = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            address = next(word for word in studio.stdout.readline().split() if word.startswith("http"))
            with sync_playwright() as play:
                browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET.split())
                for name, width, height, scheme in SHOTS:
                    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
                    page.goto(address)
                    page.wait_for_selector("body[data-shown=final]", timeout=COMPILING)
                    page.select_option("#machine", "xytheta")
                    page.wait_for_timeout(1000)
                    page.locator(".job").first.wait_for(state="detached", timeout=COMPILING)
                    page.wait_for_selector("body[data-shown=final]")
                    page.screenshot(path=HERE / name)
                page = browser.new_page(viewport={"width": 1100, "height": 860}, color_scheme="light")
                page.goto(address)
                page.wait_for_selector("body[data-shown=final]", timeout=COMPILING)
                page.set_input_files("#file", PROGRAM)
                page.wait_for_selector("body[data-view=program]")
                page.evaluate("picture.program.choose(2257)")
                page.wait_for_timeout(500)
                page.locator(".path-section").screenshot(path=HERE / "studio-program.png")
                browser.close()
        finally:
            studio.send_signal(signal.SIGINT)
            studio.wait(30)


if __name__ == "__main__":
    main()
