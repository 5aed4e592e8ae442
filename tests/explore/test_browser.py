"""The explorer in a real browser: Debian's Chromium, driven by Playwright."""

import re
import tomllib

import numpy as np
import pytest

import scissordyn as sd

from .browser import CASE, Tab, missing, served

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())

HOSTILE = "<script>alert(1)</script>"  # Name of a part that would execute a script in a page that does not escape it


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Return a case file with two clearance joints."""
    path = tmp_path_factory.mktemp("explore") / "case.toml"
    path.write_text(CASE)
    return path


@pytest.fixture(scope="module")
def url(case):
    """Yield the page of the case."""
    with served(case) as found:
        yield found


@pytest.fixture
def tab(browser, url):
    """Yield a page of its own session; a test fails if it logs an error or asks another host."""
    opened = Tab(browser, url)
    yield opened
    opened.close()


def test_slider_gives_a_new_trajectory(tab):
    """Contract: moving a slider changes the number, the run and the curves; undo and redo bring both states back."""
    assert tab.page.title() == "case.toml - scissordyn"
    tab.fine()
    before, first = tab.curve("torque"), tab.run
    slider = tab.page.get_by_role("slider", name="drive speed")
    box = slider.bounding_box()
    slider.click(position={"x": 0.75 * box["width"], "y": 0.5 * box["height"]})
    second = tab.ready(first)
    faster = tab.text("drive.speed")
    assert float(faster.split()[0]) > 150.0
    assert tab.curve("torque") != before
    tab.press("undo")
    third = tab.ready(second)
    tab.fine()
    assert tab.text("drive.speed") == "150 rpm"
    assert tab.curve("torque") == before
    tab.press("redo")
    tab.ready(third)
    assert tab.text("drive.speed") == faster


def test_scrub_moves_animation_and_cursor(tab):
    """Contract: the clock, the frame and the cursors of all curves are at the instant of the time slider."""
    tab.page.locator("[data-id=scrub]").fill("200")
    tab.page.locator("canvas[data-frame='200']").wait_for()
    assert tab.page.locator("[data-id=clock]").text_content() == "t = 4 ms"
    assert tab.page.evaluate("() => window.scissordyn.curves.cursor") == pytest.approx(4.0)
    middles = """() => [...document.querySelectorAll("#sd-curves .sd-cursor")].map(line => {
      const box = line.getBoundingClientRect(), plot = line.previousElementSibling.getBoundingClientRect();
      return (box.left - plot.left - 62) / (plot.width - 74);
    })"""
    assert np.allclose(tab.page.evaluate(middles), 0.5, atol=5e-3)
    tab.page.locator("[data-id=play]").click()
    tab.page.wait_for_timeout(300)
    tab.page.locator("[data-id=play]").click()
    assert int(tab.page.locator("#sd-canvas canvas").get_attribute("data-frame")) > 200


def test_row_of_a_contact_jumps_there(tab):
    """Contract: a click on a contact moves the animation to its start."""
    shown = tab.table()
    assert shown["titles"][2] == "start [ms]"
    tab.page.locator(".sd-rows [role=row]").nth(1).click()
    frame = round(float(shown["rows"][1][2]) / 8.0 * 400)
    tab.page.locator(f"canvas[data-frame='{frame}']").wait_for(timeout=5000)


def test_click_on_a_joint_follows_it(tab):
    """Contract: the curves of contact are those of the joint that was clicked, which stays in the middle."""
    caption = tab.page.locator("#sd-curves [data-figure=force] figcaption b")
    before, title = tab.curve("force"), str(caption.text_content())
    name = "A" if "unit 1/pivot" in title else "unit 1/pivot"
    tab.page.mouse.click(*tab.handle(name))
    tab.until(lambda: f"contact force at {name} [" in caption.text_content() and tab.curve("force") != before)
    assert f"follows joint {name}" in tab.page.locator("[data-id=note]").text_content()
    here = tab.handle(name)
    tab.page.locator("[data-id=scrub]").fill("300")
    tab.page.locator("canvas[data-frame='300']").wait_for()
    assert np.allclose(tab.handle(name), here, atol=0.5)


@pytest.mark.parametrize(("across", "down"), [(0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.5, 1.0), (1.0, 1.0)])
def test_names_stay_in_the_drawing(tab, across, down):
    """Contract: however the drawing is panned, the name of a joint that is in it is in it as a whole."""
    stage = tab.page.locator(".sd-stage")
    box = stage.locator("canvas").bounding_box()
    room = stage.evaluate("root => root.names()")
    place = tab.handle("unit 1/pivot")
    inset = 5.0  # from the edges
    wanted = [
        box["x"] + min(max(across * room["width"], inset), room["width"] - inset),
        box["y"] + min(max(down * room["height"], inset), room["height"] - inset),
    ]
    empty = box["x"] + 0.5 * room["width"], box["y"] + 0.06 * room["height"]
    tab.drag(empty, [start + end - now for start, end, now in zip(empty, wanted, place, strict=True)])
    tab.until(lambda: bool(np.allclose(tab.handle("unit 1/pivot"), wanted, atol=2.0)))
    named = stage.evaluate("root => new Promise(done => requestAnimationFrame(() => done(root.names())))")
    assert "unit 1/pivot" in [each["words"] for each in named["boxes"]]
    for each in named["boxes"]:
        assert 0.0 <= each["left"] < each["right"] <= named["width"], each
        assert 0.0 <= each["top"] < each["bottom"] <= named["height"], each


def test_dragged_pin_changes_the_case(tab):
    """Contract: while a pin is dragged it follows the pointer, assembled; released, the numbers of the case have changed."""
    first, before = tab.run, (tab.text("structure.bar_length"), tab.text("structure.angle"))
    tab.page.evaluate("""() => {
      window.written = new Set();
      const fill = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (words, ...at) {
        window.written.add(words);
        fill.call(this, words, ...at);
      };
    }""")
    x, y = tab.handle("unit 1/upper")
    mouse = tab.page.mouse
    mouse.move(x, y)
    mouse.down()
    for k in range(1, 9):
        mouse.move(x + 4 * k, y - 3 * k)
        tab.page.wait_for_timeout(30)
    tab.page.get_by_text("Drag: bar length").wait_for()
    tab.until(lambda: np.allclose(tab.handle("unit 1/upper"), (x + 32, y - 24), atol=3.0))
    assert tab.run == first
    mouse.up()
    second = tab.ready(first)
    assert tab.text("structure.bar_length") != before[0]
    assert tab.text("structure.angle") != before[1]
    tab.press("undo")
    tab.ready(second)
    assert (tab.text("structure.bar_length"), tab.text("structure.angle")) == before
    assert tab.page.locator("[data-id=note]").text_content() == ""  # what was dragged is not shown any more
    written = tab.page.evaluate("() => [...window.written]")
    assert any("clearance magnified" in words for words in written)
    assert not any("undefined" in words or "NaN" in words for words in written)


def test_dragged_length_changes_the_case(tab):
    """Contract: the handle of a bar's length changes that length alone."""
    first, angle = tab.run, tab.text("structure.angle")
    x, y = tab.handle("length unit 1/bar 1")
    tab.drag((x, y), (x + 20, y - 11))
    tab.ready(first)
    assert float(tab.text("structure.bar_length").split()[0]) > 2.05
    assert tab.text("structure.angle") == angle


def test_wrong_number_stands_beside_its_field(tab):
    """Contract: the message is in the field's row, the last good run stays, and a right number clears it."""
    first, torque = tab.run, tab.curve("torque")
    tab.type("structure.bar_length", "-1 m")
    error = tab.field("structure.bar_length").locator(".sd-error")
    error.get_by_text("out of bounds").wait_for()
    assert tab.text("structure.bar_length") == "-1 m"
    assert (tab.run, tab.curve("torque")) == (first, torque)
    tab.type("structure.bar_length", "two")
    error.get_by_text("not a number with a unit").wait_for()
    tab.type("structure.bar_length", "2.1 m")
    tab.ready(first)
    assert error.text_content() == ""


def test_pinned_run_is_compared(tab):
    """Contract: the second curve is that of the run that was pinned."""
    tab.fine()
    before, first = tab.curve("torque"), tab.run
    tab.press("pin")
    tab.page.get_by_text("Unpin 1").wait_for()
    tab.type("clearance.0.clearance", "0.2 mm")
    tab.ready(first)
    values = np.array(tab.curve("torque", pinned=True))
    before_, now = np.array(before), np.array(tab.curve("torque"))
    assert np.allclose(values / np.abs(values).max(), before_ / np.abs(before_).max(), rtol=1e-9)
    assert values.shape != now.shape or not np.allclose(values, now)
    legend = tab.page.locator(".sd-legend li").all_text_contents()
    assert [line.split(": ")[0] for line in legend] == ["now", "pinned"]
    assert all("clearance" in line and "mm" in line for line in legend), legend
    tab.press("unpin")
    tab.page.locator(".sd-bar button[data-id=unpin]:disabled").wait_for()


def test_saved_files_are_of_what_is_shown(tab, tmp_path):
    """Contract: case, run, Python, picture and film of a changed number; the case keeps its comments."""
    first = tab.run
    tab.type("drive.speed", "120 rpm")
    tab.ready(first)
    files = {}
    for name in ("case", "run", "picture", "film"):
        with tab.page.expect_download(timeout=60_000) as found:
            tab.press(name)
        files[name] = tmp_path / found.value.suggested_filename
        found.value.save_as(files[name])
    text = files["case"].read_text()
    assert tomllib.loads(text)["drive"]["speed"] == "120 rpm"
    assert text == CASE.replace("150 rpm", "120 rpm")
    assert sd.load(files["run"]).scissordyn.mechanism == sd.read_case(files["case"]).mechanism
    assert files["picture"].read_text().startswith("<?xml")
    assert files["film"].read_text().startswith("<!DOCTYPE html")
    tab.press("python")
    area = tab.page.get_by_label("the case as Python")
    area.wait_for()
    made = {}
    exec(area.input_value().rpartition("run = ")[0], made)
    assert made["mechanism"] == sd.read_case(files["case"]).mechanism
    tab.page.keyboard.press("Escape")
    assert area.count() == 0
    assert tab.page.evaluate("document.activeElement.parentElement.dataset.id") == "export"


def test_tabs_are_independent(tab, browser, url):
    """Contract: a number that changes in one page stays in the other."""
    other = Tab(browser, url)
    torque = other.curve("torque")
    first = tab.run
    tab.type("drive.speed", "100 rpm")
    tab.ready(first)
    assert other.text("drive.speed") == "150 rpm"
    assert other.curve("torque") == torque
    assert tab.curve("torque") != torque
    other.close()


def test_long_run_can_be_stopped(tab):
    """Contract: a long run shows progress; stopped, its part is shown, and it says so."""
    first = tab.run
    tab.type("run.until", "30 s")
    progress = tab.page.locator(".sd-bar progress[value]")
    progress.wait_for()
    tab.until(lambda: float(progress.get_attribute("value")) > 0.01)  # a few samples: a single one is no curve
    tab.press("stop")
    tab.ready(first)
    assert "interrupted" in tab.state
    times = tab.curve("output", axis="x")
    assert len(times) >= 1
    assert max(times) < 30.0 or max(times) < 3000.0  # in seconds or milliseconds, as suits the part


def test_errors_of_the_page_are_noticed(browser, url):
    """Limit: an error in the console, and a request to another host, make a test fail."""
    opened = Tab(browser, url)
    opened.page.evaluate("() => console.error('made on purpose')")
    with pytest.raises(AssertionError, match="made on purpose"):
        opened.close()


def test_names_are_text(browser, tmp_path):
    """Contract: a joint and a body that are named like a script show as text and run nothing, also in the film."""
    case = tmp_path / "hostile.toml"
    case.write_text(f"""
[structure]
kind = "mechanism"

[[ground]]
name = "O"
position = "0, 0 m"

[[body]]
name = "{HOSTILE}"
mass = "1 kg"
length = "0.5 m"

[[joint]]
name = "{HOSTILE}"
journal = "{HOSTILE}.start"
bearing = "ground.O"

[[clearance]]
joint = "{HOSTILE}"
clearance = "0.5 mm"

[run]
until = "50 ms"
samples = 201
""")
    with served(case) as url:
        opened = Tab(browser, url)
        assert opened.page.get_by_text(f"body {HOSTILE}").count() > 0
        opened.page.mouse.move(*opened.handle(HOSTILE))
        with opened.page.expect_download(timeout=60_000) as found:
            opened.press("film")
        film = tmp_path / "film.html"
        found.value.save_as(film)
        opened.page.goto(film.as_uri())
        names = opened.page.evaluate("() => document.querySelector('.sd-stage').names().boxes.map(box => box.words)")
        assert HOSTILE in names
        opened.errors = [error for error in opened.errors if not error.startswith("a request to file:")]
        opened.close()


def test_hard_contact(browser, tmp_path):
    """Contract: a page of hard contact opens, its clearance changes, a pin is dragged, and no number of it is unknown."""
    case = tmp_path / "hard.toml"
    hard = 'mm"\ncontact = "hard"'
    case.write_text(CASE.replace('0.5 mm"', f"0.5 {hard}").replace('0.3 mm"', f"0.3 {hard}"))
    with served(case) as url:
        tab = Tab(browser, url)
        first = tab.run
        assert "impulse [N s]" in tab.table()["titles"]
        tab.type("clearance.0.clearance", "0.2 mm")
        second = tab.ready(first)
        x, y = tab.handle("unit 1/upper")
        tab.drag((x, y), (x + 10.0, y - 5.0))
        tab.ready(second)
        assert tab.page.get_by_text(", an estimate").count() == 1
        assert tab.page.get_by_text(re.compile(r"\bnan\b", re.IGNORECASE)).count() == 0
        tab.close()


@pytest.mark.parametrize("width", [420, 800, 1280, 1920])
@pytest.mark.parametrize("dark", [False, True])
def test_layout_fits_the_window(browser, url, width, dark):
    """Contract: no horizontal scroll, a wide bar in one row, no heading cut in the table, figures in the colours asked for."""
    tab = Tab(browser, url, size=(width, 900), dark=dark)
    page = tab.page
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert (page.locator(".sd-bar").bounding_box()["height"] < 45.0) == (width >= 800)
    back = "() => [...document.querySelector('[data-figure=force] canvas').getContext('2d').getImageData(1, 1, 1, 1).data]"
    tab.until(lambda: page.evaluate(back) == ([0x1D, 0x21, 0x26, 255] if dark else [255] * 4))
    assert page.evaluate("""() => [...document.querySelectorAll("figure")].every(box => box.scrollWidth <= box.clientWidth)""")
    cut = """root => [...root.querySelectorAll("[role=columnheader]")].filter(cell => {
      const box = cell.getBoundingClientRect(), row = cell.parentElement.getBoundingClientRect();
      return cell.scrollWidth > cell.clientWidth || box.top < row.top || box.bottom > row.bottom + 1;
    }).map(cell => cell.textContent)"""
    assert page.locator(".sd-contacts").evaluate(cut) == []
    tab.close()
