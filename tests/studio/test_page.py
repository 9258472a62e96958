"""The page in a browser: what it shows is what the API gives, what it gives away is byte for byte the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import splinefeed as sf
from splinefeed.reports.record import documented
from splinefeed.studio import results
from splinefeed.studio.settings import resolve
from studio_tools import rest, value

#: Where the picture begins on the page.
BOX = "(() => { const box = document.getElementById('path').getBoundingClientRect(); return [box.x, box.y]; })()"
pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.timeout(900)]


def test_a_dxf_is_dropped_a_limit_moved_and_the_numbers_are_those_of_the_api(opened, data_dir):
    page = opened()
    file = data_dir / "dxf" / "trimesh_spline.DXF"
    rest(page, lambda: page.set_input_files("#file", str(file)))
    rest(page, lambda: page.select_option("#which", "1"))
    limits = {"feed": 60.0, "axis_acceleration": 500.0, "axis_jerk": 20000.0}
    path = sf.read(file, path=1)
    made = sf.run(path, sf.Limits(**limits))
    assert value(page, "duration_s") == made.law.duration
    before = page.inner_text("#verdict")
    rest(page, lambda: (page.fill("#limit-feed", "1200 mm/min"), page.press("#limit-feed", "Enter")))
    made = sf.run(path, sf.Limits(**{**limits, "feed": 20.0}))
    numbers = made.numbers()
    assert value(page, "duration_s") == numbers["duration_s"]
    assert value(page, "ripple_max") == numbers["ripple_max"]
    assert page.inner_text("#verdict") != before
    for name, each in numbers["limits"].items():
        assert float(page.get_attribute(f'tr[data-limit="{name}"]', "data-worst")) == each["worst"]


def test_the_first_picture_does_not_wait_for_the_library_of_figures(opened):
    page = opened()
    page.wait_for_function("() => window.Plotly")
    page.add_init_script(
        "new MutationObserver((_, own) => { if (!document.body?.dataset.shown) return; own.disconnect();"
        " window.early = document.querySelector('script[src*=plotly]') !== null; })"
        ".observe(document, { subtree: true, childList: true, attributeFilter: ['data-shown'] });"
    )
    page.reload()
    page.wait_for_selector("body[data-shown=final]")
    assert page.evaluate("early") is False
    page.wait_for_function("() => window.Plotly")  # and it comes without being asked for


def test_setpoints_are_downloaded_byte_for_byte(opened, tmp_path):
    page = opened()
    asked = {"source": {"shape": "circle?radius=10"}}
    rest(page, lambda: (page.fill("#shape", "circle?radius=10"), page.press("#shape", "Enter")))
    page.click("#save")
    with page.expect_download() as got:
        page.click('#save-menu [data-what="setpoints"][data-form="csv"]')
    got.value.save_as(tmp_path / "got.csv")
    wanted = resolve(asked, tmp_path)
    made = sf.run(wanted.path, wanted.limits, strategy=wanted.strategy)
    said = results.numbers(wanted, made, ("csv",))
    sf.save(documented(made, said).points, tmp_path / "own.csv")
    assert (tmp_path / "got.csv").read_bytes() == (tmp_path / "own.csv").read_bytes()
    assert got.value.suggested_filename == "setpoints.csv"


def test_a_path_in_space_is_drawn_turned_and_told_under_the_mouse(opened, tmp_path):
    page = opened()
    file = tmp_path / "helix.nc"
    file.write_text("G21 G90 G17\nG0 X20 Y0 Z0\nF3600\nG2 X20 Y0 I-20 J0 Z-5\nM2\n", encoding="ascii")
    rest(page, lambda: page.set_input_files("#file", str(file)))
    rest(page, lambda: page.uncheck("#by-control"))
    page.wait_for_function(
        "document.getElementById('path').ariaLabel.startsWith('the path over x (mm), y (mm), z (mm)')"
    )
    middle = "(() => { const k = picture.points.x.length >> 1; return [...picture.at(k), picture.points.z[k]]; })()"
    x, y, z = page.evaluate(middle)
    inside = page.evaluate(
        "picture.points.x.every((_, k) => { const [x, y] = picture.at(k);"
        " return x > 0 && y > 0 && x < picture.width && y < picture.height; })"
    )
    assert inside
    assert -5.0 < z < 0.0
    page.locator("#path").hover(position={"x": x, "y": y})
    told = page.inner_text("#hover")
    assert f"z {z:.3f} mm" in told
    assert "mm/min" in told
    page.mouse.down()
    page.mouse.move(*[sum(pair) for pair in zip(page.evaluate(BOX), (x + 60, y + 10), strict=True)], steps=4)
    page.mouse.up()
    assert page.evaluate(middle)[:2] != [x, y]


def test_what_is_wrong_is_said_beside_its_field(opened, tmp_path):
    page = opened()
    page.fill("#limit-axis_jerk", "-3")
    page.press("#limit-axis_jerk", "Enter")
    page.wait_for_selector('[id="error-limits.axis_jerk"]:visible')
    assert "greater than 0" in page.inner_text('[id="error-limits.axis_jerk"]')
    assert page.get_attribute("#limit-axis_jerk", "aria-invalid") == "true"
    broken = tmp_path / "part.dxf"
    broken.write_bytes(b"  0\nSECTION\n  2\nENTITIES\n  0\nSPLINE\n 70\nnonsense\n")
    page.set_input_files("#file", str(broken))
    page.wait_for_selector("#error-source:visible")
    words = page.inner_text("#error-source")
    assert "part.dxf" in words
    assert "/" not in words.replace("and/or", "")


def test_a_drawing_of_several_contours_is_planned_and_drawn_as_one_motion(opened, tmp_path):
    page = opened()
    file = tmp_path / "holes.dxf"
    holes = [sf.shapes.from_text("circle?radius=4").transformed([[1, 0], [0, 1]], [x, 0]) for x in (-10, 10)]
    sf.write(holes, file)
    rest(page, lambda: page.set_input_files("#file", str(file)))
    made = sf.run(sf.read(file), sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0))
    assert value(page, "duration_s") == made.law.duration
    assert "2 contours are one motion" in page.inner_text("#notes")
    inside = (
        "picture.points.x.every((x, k) => { const [px, py] = picture.at(k); return !Number.isFinite(x)"
        " || (px > 0 && py > 0 && px < picture.width && py < picture.height); })"
    )
    assert page.evaluate(inside)
    dashed = "picture.rapid && Array.from(picture.rapid.x).filter(Number.isFinite).length"
    assert page.evaluate(dashed) == 2
    rest(page, lambda: (page.fill("#clearance", "5 mm"), page.press("#clearance", "Enter")))
    made = sf.run(sf.read(file).job(clearance=5.0), sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0))
    assert value(page, "duration_s") == made.law.duration
    rest(page, lambda: page.select_option("#which", "2"))
    made = sf.run(sf.read(file, path=2), sf.Limits(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0))
    assert value(page, "duration_s") == made.law.duration


def test_a_urdf_and_a_motion_are_dropped_and_the_arm_is_drawn(opened, tmp_path):
    page = opened()
    urdf = Path(__file__).parents[1] / "data/two-link.urdf"
    motion = tmp_path / "move.json"
    motion.write_text(json.dumps({"waypoints": [[0, 0.5], [0.8, -0.4], [1.5, 0.9]]}), encoding="utf-8")
    page.set_input_files("#file", str(urdf))
    rest(page, lambda: page.set_input_files("#file", str(motion)))
    arm = sf.robot(urdf)
    made = sf.run(arm.through([[0, 0.5], [0.8, -0.4], [1.5, 0.9]]), arm.limits, strategy="time-optimal")
    assert value(page, "duration_s") == made.law.duration
    assert page.locator('tr[data-limit="torque.elbow"]').count() == 1
    page.screenshot(path=str(tmp_path / "arm.png"))


def test_steps_fit_beside_the_loops_and_nothing_of_the_figure_before_stays_on_them(opened):
    page = opened()
    rest(page, lambda: page.select_option("#machine", "xytheta"))
    page.click("#tab-motion")
    page.wait_for_selector("#figure .readout")
    page.click("#tune-start")
    page.wait_for_selector("#beside .main-svg")
    page.wait_for_function(
        "() => Math.abs(figure._fullLayout.width - figure.clientWidth) < 2 && figure.clientWidth < beside.clientWidth"
    )
    high = page.evaluate(
        "(place => [place._fullLayout.height, place.layout.height])(document.getElementById('figure'))"
    )
    assert high[0] == high[1] > 300
    page.set_viewport_size({"width": 1180, "height": 900})
    page.wait_for_function("() => Math.abs(figure._fullLayout.width - figure.clientWidth) < 2")
    assert page.evaluate("figure._fullLayout.height") == high[0]
    assert page.locator("#figure .readout:visible").count() == 0
    assert page.locator("#figure .cursor:visible").count() == 0
