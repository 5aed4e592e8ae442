"""Numbers of tables as text, in Python and in the browser."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scissordyn.explore.serve import ASSETS
from scissordyn.numeral import LEAST, decimals, numeral, numerals

from .browser import chromium, missing


def drawn() -> list[tuple[float, int]]:
    """Numbers of all sizes with digits after the point; halves and carries, which are rounded, among them."""
    chance = np.random.default_rng(3)
    sizes = 10.0 ** chance.uniform(-14.0, 14.0, 4000) * chance.choice([-1.0, 1.0], 4000)
    halves = [0.125, 12.125, -2.5, 0.5, 1.5, 9.995, 9.9996, 99.96, 0.09996, 9.996e-9, -9.996e9, 1e7, 9999999.5, 1e-5, 1e22]
    special = [0.0, -0.0, math.nan, math.inf, -math.inf, 1e-300, 1.7e308]
    return [(value, places) for value in (*sizes.tolist(), *halves, *special) for places in (0, 2, 5)]


def test_number_has_three_digits_or_more() -> None:
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
        assert len(figures) >= LEAST or value == 0.0
        assert float(text) == pytest.approx(value, rel=1e-12, abs=0.5 * last * (1.0 + 1e-9))


def test_column_has_common_digits() -> None:
    """Contract: the largest number chooses the digits after the point; small ones beside it have more."""
    assert numerals([42.944, 9.5, 0.0232, math.nan]) == ["42.94", "9.50", "0.0232", "-"]
    assert numerals([0.0, 0.0]) == ["0.000", "0.000"]
    assert decimals([12345.6, 1.0], 5) == 0
    assert decimals([math.nan]) == 3


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_browser_writes_the_same() -> None:
    """Cross-check: the function of the page gives the text of the one in Python for every number."""
    source, cases = (ASSETS / "numeral.js").read_text(encoding="utf-8").replace("export ", ""), drawn()
    words = [["NaN" if math.isnan(value) else repr(value).replace("inf", "Infinity"), places] for value, places in cases]
    with chromium() as browser:
        page = browser.new_page()
        found = page.evaluate(
            "([source, cases]) => { const numeral = new Function(source + '; return numeral')();"
            " return cases.map(([value, places]) => numeral(Number(value), places)); }",
            [source, words],
        )
        page.close()
    assert found == [numeral(value, places) for value, places in cases]
