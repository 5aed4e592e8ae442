"""Hard contact against the event-driven solution of the comparison of engines."""

import numpy as np
import pytest
from validation.engines.compare import PAGE, _with_kept, rewritten
from validation.engines.convergence import CLEARANCE, JOURNAL, START, energy, ours
from validation.engines.exact_pin import Pin, motion
from validation.engines.picture import draw_errors, draw_order, marks, sections, table_rows


@pytest.fixture(scope="module")
def exact():
    """Return the pendulum with friction and its exact state after 0.5 s."""
    pin = Pin(CLEARANCE, JOURNAL + CLEARANCE, 0.7, 0.2)
    states, impacts = motion(pin, np.array([0.5]), np.array(START))
    assert impacts > 20  # an infinite sequence of impacts, up to the speed of rest
    return pin, states[-1]


def test_located_events_converge_to_the_exact_motion_with_order_two(exact):
    """Order of convergence: a pendulum on a pin in a hole, against its event-driven solution."""
    pin, state = exact
    errors = [abs(ours(pin, step, "located")[0][-1, 2] - state[2]) for step in (1e-3, 1e-4, 1e-5)]
    assert errors[2] < 2e-8
    assert np.log10(errors[0] / errors[2]) / 2.0 == pytest.approx(2.0, abs=0.2)


def test_crossed_events_converge_to_another_motion(exact):
    """Limit: closed contacts that yield leave a difference that shorter steps do not remove."""
    pin, state = exact
    ends = [ours(pin, step, "crossed")[0][-1, 2] for step in (1e-5, 5e-6)]
    assert abs(ends[1] - ends[0]) < 0.2 * abs(ends[1] - state[2]) < 1e-6


def test_contact_without_loss_keeps_the_energy():
    """Closed form: with restitution 1 and without friction the energy stays zero while 4.9 J fall."""
    pin = Pin(CLEARANCE, JOURNAL + CLEARANCE, 1.0)
    assert np.abs(energy(pin, ours(pin, 1e-4, "located")[0])).max() < 1e-6
    states, _ = motion(pin, np.linspace(0.0, 0.2, 5)[1:], np.array(START))
    assert np.abs(energy(pin, states)).max() < 1e-12


def test_rows_of_named_engines_replace_those_of_the_page():
    """Contract: rows of engines that are not run again stay, and each row is there once."""
    names = ("slider-crank", "scissor array", "parallelogram", "pin in a hole")
    before = _with_kept({name: [] for name in names})
    fresh = [["drake", setting, "1", "2", "3", "4", ""] for setting in ("default", "careful")]
    after = _with_kept({name: [*fresh] for name in names})
    for name in names:
        assert [row[:2] for row in after[name]] == [row[:2] for row in before[name]]
        assert [row for row in after[name] if row[0] == "drake"] == fresh
        assert [row for row in after[name] if row[0] != "drake"] == [row for row in before[name] if row[0] != "drake"]


@pytest.fixture(scope="module")
def tables():
    """Return the tables of the page by heading."""
    return {heading: table_rows(text) for heading, text in sections(PAGE.read_text(encoding="utf-8")).items()}


def test_page_has_the_texts_of_its_source():
    """Contract: the page is its texts with its own numbers, so that writing it again without runs changes nothing."""
    assert rewritten() == PAGE.read_text(encoding="utf-8")


def test_picture_of_errors_has_each_row_with_numbers_and_readable_names(tables):
    """Contract: one mark for each row with numbers, one name for each engine; no two names overlap, none leaves its panel."""
    *mechanisms, _ = tables.items()
    figure = draw_errors(dict(mechanisms))
    for axes, (heading, rows) in zip(figure.axes, mechanisms, strict=True):
        points = sorted([float(row[5]), float(row[4])] for row in rows[2:] if row[4] and row[5])
        drawn = [line.get_xydata()[0].tolist() for line in axes.lines if line.get_marker() in ("o", "s")]
        assert axes.get_title() == heading
        assert sorted(drawn) == points
        boxes = [text.get_window_extent() for text in axes.texts]
        assert sorted(text.get_text() for text in axes.texts) == sorted({row[0] for row in rows[2:] if row[4] and row[5]})
        assert not any(box.overlaps(other) for k, box in enumerate(boxes) for other in boxes[:k])
        assert all(axes.bbox.contains(*corner) for box in boxes for corner in box.corners())


def test_engines_as_accurate_as_the_defaults_take_five_times_as_long(tables):
    """Contract: the sentence below the picture holds for the numbers of the page; engines without energies solve positions."""
    *mechanisms, _ = tables.items()
    ratios = {}
    for heading, rows in mechanisms:
        forces, found = {row[0] for row in rows[2:] if row[3]}, marks(rows)
        seconds, error = found["scissordyn"]["default"]
        for name in forces - {"scissordyn"}:
            accurate = [time / seconds for time, angle in found[name].values() if angle <= error]
            if accurate:
                ratios[heading, name] = min(accurate)
    exceptions = {("Parallelogram", "dart"), ("Parallelogram", "pinocchio")}
    assert exceptions < ratios.keys()
    assert min(ratio for place, ratio in ratios.items() if place not in exceptions) >= 5.0


def test_picture_of_orders_has_the_numbers_of_its_table(tables):
    """Contract: three codes at three steps, and dotted lines with slopes 1 and 2."""
    *_, rows = tables.values()
    lines = draw_order(rows).axes[0].lines
    drawn = [point for line in lines if line.get_linestyle() == "-" for point in line.get_xydata().tolist()]
    assert sorted(drawn) == sorted([float(row[1]), float(row[2])] for row in rows[3:])
    slopes = [np.diff(np.log(line.get_xydata()), axis=0) for line in lines if line.get_linestyle() == ":"]
    assert [float(np.mean(slope[:, 1] / slope[:, 0])) for slope in slopes] == pytest.approx([1.0, 2.0])
