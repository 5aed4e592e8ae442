"""Scripts of the page in Chromium without a server: curves, messages as it unpacks them, and numbers as text."""

import json
import math

import numpy as np
import pytest

pytest.importorskip("websockets", reason="the package websockets is not installed")

from scissordyn.explore.serve import ASSETS, pack_message
from scissordyn.numeral import DIGITS_MIN, decimals, numeral, numerals

# JavaScript function that imports the given source
LOAD = """async code => {
  const url = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  Object.assign(window, await import(url));
}"""


@pytest.fixture(scope="module")
def page(browser):
    """Return an empty page with the functions of the scripts."""
    page = browser.new_page(viewport={"width": 900, "height": 700})
    script = (ASSETS / "page.js").read_text(encoding="utf-8")
    unpack = script[script.index("export function unpack") : script.index("// ---- the drawing")]
    page.set_content("<style>figure { margin: 0 } canvas { width: 800px }</style><div id=curves style='width: 800px'></div>")
    parts = "".join((ASSETS / name).read_text(encoding="utf-8") for name in ("element.js", "curves.js"))
    page.evaluate(LOAD, parts.replace('import { element } from "./element.js";', "") + unpack)
    return page


def test_message_comes_as_it_was_sent(page):
    """Identity: numbers bit for bit, what is not finite in arrays, an array of two places once, bytes."""
    numbers = np.array([0.1, -1e-300, np.pi, np.inf, -0.0])
    message = {"type": "run", "one": {"x": numbers, "words": "ä µ"}, "two": [numbers, 3, None], "file": b"\x00\xff!"}
    sent = pack_message(message)
    assert len(sent) < 300
    script = """bytes => {
      const { one, two, file, type } = unpack(new Uint8Array(bytes).buffer), list = Array.from;
      return [type, one.words, list(one.x).map(x => [x.toString(), Object.is(x, -0)]), one.x === two[0], two.slice(1),
        list(file)];
    }"""
    kind, words, values, same, rest, content = page.evaluate(script, list(sent))
    assert (kind, words, same, rest, content) == ("run", "ä µ", True, [3, None], [0, 255, 33])
    assert [float(text.replace("Infinity", "inf")) for text, _ in values] == numbers.tolist()
    assert values[-1][1] is True
    with pytest.raises(ValueError, match="JSON"):
        pack_message({"x": float("nan")})


@pytest.mark.parametrize("count", [50, 100_000])
def test_gaps_and_peaks_of_a_line_stay(page, count):
    """Contract: of few points and of many the extremes of each column of pixels are drawn, and nothing joins across a gap."""
    chance = np.random.default_rng(2)
    x = np.linspace(0.0, 1.0, count)
    y = np.sin(40.0 * x) + 0.1 * chance.standard_normal(count)
    y[count // 3] = 50.0
    y[2 * count // 3 : 2 * count // 3 + count // 10] = np.nan
    columns, (start, end) = 400, (0.2, 0.95)
    script = """([x, y, from, to, columns]) =>
      [...decimated(x, y.map(each => each ?? NaN), from, to, columns)].map(each => Number.isNaN(each) ? null : each)"""
    found = page.evaluate(script, [x.tolist(), [None if np.isnan(each) else each for each in y], start, end, columns])
    points = np.array(found, float).reshape(-1, 2)
    assert len(points) < 4 * columns + 60
    assert {(a, b) for a, b in points if not np.isnan(b)} <= set(zip(x.tolist(), y.tolist(), strict=True))
    inside = (x >= start) & (x <= end) & np.isfinite(y)
    column = np.floor((x[inside] - start) / (end - start) * columns)
    for reduce in (np.minimum, np.maximum):
        wanted = reduce.reduceat(y[inside], np.flatnonzero(np.diff(column, prepend=-1.0)))
        assert set(wanted) <= set(points[:, 1])
    first, last = x[2 * count // 3 - 1], x[2 * count // 3 + count // 10]
    after = int(np.flatnonzero(points[:, 0] >= last)[0])
    before = int(np.flatnonzero(points[:, 0] <= first)[-1])
    assert np.isnan(points[before + 1 : after, 1]).any()


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.0, 1.0, ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
        (-3e-5, 4e-5, ["\N{MINUS SIGN}0.00002", "0.00000", "0.00002", "0.00004"]),
        (0.0, 4e7, ["0", "1e+7", "2e+7", "3e+7", "4e+7"]),
    ],
)
def test_ticks_are_round(page, low, high, labels):
    """Closed form: at 1, 2 or 5 times a power of ten within the range, with digits enough to tell them apart."""
    found = page.evaluate("([low, high]) => ticks(low, high, 5)", [low, high])
    assert [label for _, label in found] == labels


# JavaScript function that draws a figure with a given number of points
SHOW = """count => {
  const x = Float64Array.from({ length: count }, (_, k) => k / count);
  const line = n => ({ label: `line ${n}`, color: "blue", style: "solid", x, y: x.map(t => Math.sin(40 * t + n)) });
  window.picked = [];
  window.curves = new Curves(document.getElementById("curves"), { onPick: (x, key) => window.picked.push([x, key]) });
  const lines = Array.from({ length: 20 }, (_, n) => line(n));
  window.figures = [{ name: "many", title: "many", unit: "m", axis: "time [s]", levels: [], lines }];
  window.curves.show(window.figures, { full: [0, 1], run: 7 });
  window.curves.draw();
}"""


def test_keys_and_pointer_zoom_and_pick(page):
    """Contract: plus, minus, arrows, Home and a dragged band change the range within its ends; Enter and clicks pick a time."""
    page.evaluate(SHOW, 100_000)
    canvas = page.locator("#curves canvas")

    def span():
        return list(page.evaluate("() => window.curves.range"))

    canvas.focus()
    for key, wanted in (
        ("+", (0.2, 0.8)),
        ("ArrowRight", (0.26, 0.86)),
        ("ArrowLeft", (0.2, 0.8)),
        ("-", (0.0, 1.0)),
        ("+", (0.2, 0.8)),
        ("Home", (0.0, 1.0)),
    ):
        page.keyboard.press(key)
        assert span() == pytest.approx(wanted), key
    box = canvas.bounding_box()
    left, wide = box["x"] + 62.0, box["width"] - 74.0
    page.mouse.move(left + 0.25 * wide, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(left + 0.5 * wide, box["y"] + 40, steps=4)
    page.mouse.up()
    assert span() == pytest.approx((0.25, 0.5), abs=2e-3)
    page.mouse.click(left + 0.5 * wide, box["y"] + 40)
    page.keyboard.press("Enter")
    picked = page.evaluate("() => window.picked")
    assert [x for x, _ in picked] == pytest.approx([0.375, 0.375], abs=2e-3)
    page.mouse.wheel(0, 4000)
    page.wait_for_function("() => window.curves.range[0] === 0 && window.curves.range[1] === 1")
    # another run of the same length keeps what somebody has zoomed
    page.keyboard.press("+")
    page.evaluate("() => window.curves.show(window.figures, { full: [0, 1] })")
    assert span() == pytest.approx((0.2, 0.8))
    assert json.loads(page.evaluate("() => JSON.stringify(document.querySelector('#curves').dataset.run)")) == "0"


def drawn():
    """Return numbers of all sizes with their digits after the point, with halves and carries, which are rounded."""
    chance = np.random.default_rng(3)
    sizes = 10.0 ** chance.uniform(-14.0, 14.0, 4000) * chance.choice([-1.0, 1.0], 4000)
    halves = [0.125, 12.125, -2.5, 0.5, 1.5, 9.995, 9.9996, 99.96, 0.09996, 9.996e-9, -9.996e9, 1e7, 9999999.5, 1e-5, 1e22]
    special = [0.0, -0.0, math.nan, math.inf, -math.inf, 1e-300, 1.7e308]
    return [(value, places) for value in (*sizes.tolist(), *halves, *special) for places in (0, 2, 5)]


def test_number_has_three_digits_or_more():
    """Contract: the text has three significant digits and is the number rounded to them; zeros are kept."""
    assert [numeral(value) for value in (9.5, 0.1, 123456.7, 0.00095, 4e-9, 0.0)] == [
        "9.50",
        "0.100",
        "123457",
        "0.000950",
        "4.00e-9",
        "0",
    ]
    for value, places in drawn():
        text = numeral(value, places)
        if not math.isfinite(value):
            assert text == "-"
            continue
        mantissa, _, power = text.partition("e")
        figures = mantissa.lstrip("-").replace(".", "").lstrip("0")
        last = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        assert len(figures) >= DIGITS_MIN or value == 0.0
        assert float(text) == pytest.approx(value, rel=1e-12, abs=0.5 * last * (1.0 + 1e-9))


def test_column_has_common_digits():
    """Contract: the largest number chooses the digits after the point; small ones beside it have more."""
    assert numerals([42.944, 9.5, 0.0232, math.nan]) == ["42.94", "9.50", "0.0232", "-"]
    assert numerals([0.0, 0.0]) == ["0.000", "0.000"]
    assert decimals([12345.6, 1.0], 5) == 0
    assert decimals([math.nan]) == 3


def test_browser_writes_the_same(page):
    """Cross-check: the function of the page gives the text of the one in Python for every number."""
    source, cases = (ASSETS / "table.js").read_text(encoding="utf-8"), drawn()
    source = source[source.index("const LEAST_FIGURES") : source.index("// ---- the table")]
    words = [["NaN" if math.isnan(value) else repr(value).replace("inf", "Infinity"), places] for value, places in cases]
    found = page.evaluate(
        "([source, cases]) => { const numeral = new Function(source + '; return numeral')();"
        " return cases.map(([value, places]) => numeral(Number(value), places)); }",
        [source, words],
    )
    assert found == [numeral(value, places) for value, places in cases]
