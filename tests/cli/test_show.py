"""Results as people read them."""

import io
import json
import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from reference.paper_case import paper_case
from scissordyn.cli.catalogue import plain_formula
from scissordyn.cli.compare import change, differences
from scissordyn.cli.main import status_of
from scissordyn.cli.output import print_words
from scissordyn.cli.show import column, show_run
from scissordyn.cli.text_console import TextConsole
from scissordyn.laws.catalogue import BY_KIND, MATERIALS
from scissordyn.numeral import PREFIXES, prefix
from scissordyn.units import cell, short


@pytest.mark.parametrize(
    ("largest", "letter"),
    [(0.0, ""), (math.nan, ""), (1.0, ""), (999.0, ""), (1e3, "k"), (0.5, "m"), (2e-5, "µ"), (1e-15, "p")],
)
def test_prefix_leaves_a_number_between_one_and_a_thousand(largest, letter):
    """Closed form: engineering prefixes."""
    assert PREFIXES[prefix(largest)] == letter


def test_words_of_a_table_are_not_broken(capsys):
    """Contract: a table that is too narrow for its longest words is printed as a list of each row's cells."""
    head = ("response", "structure.bars.section.wall", "material = aluminium instead of steel")
    print_words(head, [("peak_utilisation", "-0.84 ± 0.10", "x 0.863")])
    table = capsys.readouterr().out
    assert "structure.bars.section.wall" in table
    assert "peak_utilisation: " not in table
    print_words((*head, "x" * 50), [("peak_utilisation", "-0.84 ± 0.10", "x 0.863", "")])
    assert capsys.readouterr().out.splitlines() == [
        "response: peak_utilisation",
        "  structure.bars.section.wall: -0.84 ± 0.10",
        "  material = aluminium instead of steel: x 0.863",
    ]


def test_differences_of_values_of_different_kinds():
    """Contract: an entry that one of two cases lacks is shown with a dash, whichever kind of value the other has."""
    assert list(differences({"points": (1.0, 2.0)}, {"points": None})) == [("points", "2 entries", "-")]
    assert list(differences({"points": None}, {"points": (1.0, 2.0)})) == [("points", "-", "2 entries")]


def test_column_has_one_unit_and_aligned_decimals():
    """Contract: decimals as the largest needs for five digits, more for fewer than three; unknown is a dash."""
    unit, texts = column(np.array([12345.6, -1.0, math.nan]), "N")
    assert unit == "kN"
    assert texts == ["12.346", "-0.00100", "-"]
    assert column(np.array([-107.816]), "deg") == ("deg", ["-107.82"])
    assert column(np.array([0.7351429]), "m/s") == ("m/s", ["0.7351"])
    assert column(np.array([math.nan]), "s") == ("s", ["-"])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        *((0.0012, "m", "1.2 mm"), (2.5e4, "N m", "25 kN m"), (0.003, "m/s", "3 mm/s"), (1e8, "N/m^1.5", "100 MN/m^1.5")),
        *((0.2, "kg", "200 g"), (1e-5, "kg", "10 mg"), (1500.0, "kg", "1500 kg"), (8e-5, "kg m^2", "8e-05 kg m^2")),
        *((0.001256, "m^2", "0.001256 m^2"), (2500.0, "1/m", "2500 1/m"), (2.5e4, "N or N m", "2.5e+04 N or N m")),
    ],
)
def test_prefixes_keep_the_value(value, unit, text):
    """Contract: no prefix where it would be raised to a power, where kg has one already, or before two units."""
    assert short(value, unit) == text
    assert cell(value, unit).partition(" ")[2] == text.partition(" ")[2]


def test_change_in_words():
    """Closed form: percent, and multiples from ten on."""
    others = (3.0, 2.0, -1.0, 40.0, 16720.0)
    assert [change(2.0, other) for other in others] == ["+50 %", "+0 %", "-150 %", "20 times", "8360 times"]
    assert [change(0.0, other) for other in (0.0, 1.0)] == ["0 %", "-"]


def test_one_number_in_words():
    """Closed form: four digits."""
    assert [short(84074.9, "N"), short(0.05, "s"), short(0.0, "J")] == ["84.07 kN", "50 ms", "0 J"]
    # an inertia of small parts is not round-off; its unit has no prefix
    assert [short(8e-19, "kg m^2"), short(-1e-16, "m"), short(1e-16, "1"), short(-0.0, "1/K")] == [
        "8e-19 kg m^2",
        "0 m",
        "0 1",
        "0 1/K",
    ]


def small_run():
    """Return a run with three contacts of two joints, the last one unfinished, whose numbers are easy to add up."""
    along = "contact"
    return xr.Dataset(
        {
            "contact_joint": (along, ["A", "unit 1/pivot", "A"]),
            "contact_start": (along, [0.01, 0.02, 0.08]),
            "approach_speed": (along, [0.5, 0.25, 0.125]),
            "contact_angle": (along, [0.0, math.pi, -0.5 * math.pi]),
            "peak_force": (along, [1000.0, 2000.0, 3000.0]),
            "peak_time": (along, [0.005, 0.01, 0.01]),
            "contact_duration": (along, [0.01, 0.05, math.nan]),
            "rebound_speed": (along, [-0.4, -0.2, math.nan]),
            "energy_residual": ("time", [0.0, -2e-6, 1e-6]),
            "kinetic_energy": ("time", [0.0, 10.0, 20.0]),
            "potential_energy": ("time", [0.0, 0.0, 0.0]),
            "drive_work": ("time", [0.0, 10.0, 20.0]),
        },
        attrs={
            "end": 0.1,
            "statistics": json.dumps({"method": "rodas5p", "steps": 7, "rejected": 2, "seconds": 0.25}),
            "warnings": json.dumps(["approach speed 1.2 m/s [above the law's range]"]),
            "trusted_until": 0.04,
            "trusted_contacts": 2,
        },
    )


def shown(run, rows=20, width=100):
    """Return what is printed about a run."""
    to = TextConsole(file=io.StringIO(), width=width, highlight=False)
    show_run(run, rows, to=to)
    assert isinstance(to.file, io.StringIO)
    return to.file.getvalue()


def test_table_of_contacts():
    """Contract: a row for each contact, units in the heading, a dash where the run ended first."""
    lines = shown(small_run()).splitlines()
    rows = [line.split() for line in lines if line.strip()[:2] in ("1 ", "2 ", "3 ")]
    assert rows[0] == ["1", "A", "10.000", "0.5000", "0.00", "1.0000", "5.000", "10.000", "-0.4000"]
    assert rows[1] == ["2", "unit", "1/pivot", "20.000", "0.2500", "180.00", "2.0000", "10.000", "50.000", "-0.2000"]
    assert rows[2][-2:] == ["-", "-"]
    heading = next(line for line in lines if "[ms]" in line)
    assert heading.split() == ["contact", "joint", "[ms]", "[m/s]", "[deg]", "[kN]", "[ms]", "[ms]", "[m/s]"]


def test_summary_adds_up():
    """Closed form: fractions of time, largest forces and when, the energy residual, and warnings as they are."""
    text = " ".join(shown(small_run(), rows=0).split())
    assert "100 ms simulated in 250 ms: 7 steps of rodas5p, 2 rejected." in text
    assert "Joint A: 2 contacts, in contact 30 % of the time, largest force 3 kN at 90 ms." in text
    assert "Joint unit 1/pivot: 1 contact, in contact 50 % of the time, largest force 2 kN at 30 ms." in text
    assert "closes to 2 µJ, 1.0e-07 of the converted energy." in text
    assert "Trusted until 40 ms, through 2 contacts." in text
    assert "Warning: approach speed 1.2 m/s [above the law's range]" in text


def test_a_run_without_contacts_has_no_table():
    """Limit: no contact at all, no instant at all."""
    run = small_run().isel(contact=slice(0, 0), time=slice(0, 0))
    del run.attrs["trusted_until"]
    run.attrs["end"] = 0.0
    text = shown(run)
    assert "contact" not in text
    assert "energy" not in text
    assert "Trusted" not in text


def test_every_law_and_material_is_listed(capsys):
    """Contract: the printed list against the catalogue; each entry can be shown by its name, and has no LaTeX."""
    assert status_of(["laws"]) == 0
    listed = {line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()}
    for kind, known in BY_KIND.items():
        assert set(known) <= listed
        for name, law in known.items():
            assert status_of(["laws", name]) == 0
            text = capsys.readouterr().out
            assert f"{name}, a law of {kind}" in text
            assert law.source in " ".join(text.split())
            assert "\\" not in text
            assert ".. math" not in text
    for name in MATERIALS:
        assert name in listed
        assert status_of(["laws", name]) == 0
        assert f"{name}, a material: E = " in capsys.readouterr().out


HOSTILE = "[/red][link=http://x]:smile:\x1b[31m\x07\u202e"
"""Text that a terminal must not interpret: markup, an emoji's name, an escape code, a bell and a change of direction."""


def test_names_are_text():
    """Contract: a name is printed as it is, its control characters as their codes, in the table, the summary and warnings."""
    run = small_run()
    run["contact_joint"] = ("contact", [HOSTILE, "unit 1/pivot", HOSTILE])
    run.attrs["warnings"] = json.dumps([f"joint '{HOSTILE}'"])
    text = "".join(shown(run, width=140).split())
    assert text.count(r"[/red][link=http://x]:smile:\x1b[31m\x07\u202e") == 5
    assert not any(letter in text for letter in "\x1b\x07\u202e")


def many_joints(names):
    """Return a run with one contact of each joint, the first with the smallest force."""
    run = small_run().isel(contact=np.zeros(len(names), int))
    run["contact_joint"] = ("contact", names)
    run["peak_force"] = ("contact", 1e3 * (1.0 + np.arange(len(names))))
    return run


def test_many_joints_are_a_table():
    """Contract: one row for each joint, the largest force first, in place of a sentence for each."""
    names = [f"unit {k}/pivot" for k in range(1, 13)]
    text = shown(many_joints(names), rows=0)
    rows = [line.split() for line in text.splitlines() if "/pivot" in line and "Largest" not in line]
    assert [" ".join(row[1:3]) for row in rows] == names[::-1]
    assert rows[0] == ["1", "unit", "12/pivot", "10.0", "12.000", "15.000"]
    assert "Joint unit" not in text


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_narrow_tables_never_cut_digits(width):
    """Contract: every number of the columns that are shown is there with all its digits, whatever the width."""
    run = many_joints(["a joint with a name that is much too long for any table", "B", "C", "D"])
    text = shown(run, width=width)
    assert all(len(line) <= width for line in text.splitlines())
    assert "…" not in text
    for number in ("1.0000", "2.0000", "3.0000", "4.0000", "10.000"):
        assert number in text
    assert ("Left out at this width" in text) == (width < 100)


@pytest.mark.parametrize(
    ("command", "names"),
    [
        (["laws"], {name for kind in BY_KIND.values() for name in kind} | set(MATERIALS)),
        (["controllers"], {"feed-forward", "pyragas"}),
        (["laws", "lugre"], {"bristle_stiffness", "stribeck_exponent"}),
        (["controllers", "feed-forward"], {"eccentricity_rate_damping", "regularisation_length"}),
    ],
)
def test_names_can_be_typed_from_a_narrow_table(command, names, capsys, monkeypatch):
    """Contract: names and defaults, which are copied into case files, are not cut where the terminal has 60 columns."""
    for module in ("output", "catalogue"):
        monkeypatch.setattr(f"scissordyn.cli.{module}.console", lambda: TextConsole(highlight=False, width=60))
    assert status_of(command) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(len(line) <= 60 for line in lines)
    assert names <= {line.split()[0] for line in lines if line.strip()}
    assert not any("…" in line for line in lines)


def test_formulas_are_readable():
    """Closed form: fractions, Greek letters and powers in characters."""
    assert plain_formula(r"\frac{8(1-c_e)}{5 c_e}") == "(8(1-c_e))/(5 c_e)"
    assert plain_formula(r"\ln\frac{a}{b} + \sigma_0^2") == "ln(a/b) + σ_0²"
    assert plain_formula(r"z' = v - \frac{|v|}{g(v)} z,\quad F = K \delta^{3/2}") == "z' = v - |v|/(g(v)) z,\nF = K δ^(3/2)"


def test_run_and_check_for_other_programs(tmp_path, capsys):
    """Contract: --json prints one line with the figures of the run that is saved; --quiet prints nothing."""
    case, saved = tmp_path / "case.toml", tmp_path / "run.nc"
    case.write_text(paper_case("3 ms"))
    assert status_of(["run", str(case), "-o", str(saved), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    run = sd.load(saved)
    assert found["status"] == "complete"
    assert found["end"] == 3e-3
    assert found["files"] == [str(saved)]
    assert [(joint["name"], joint["contacts"]) for joint in found["joints"]] == [("A", run.sizes["contact"])]
    assert found["joints"][0]["largest"] == float(run["peak_force"].max())
    assert status_of(["check", str(case), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["clearance_joints"] == ["A"]
    for command in (["run", str(case), "--set", "run.until=1 ms", "--quiet"], ["check", str(case), "-q"]):
        assert status_of(command) == 0
        captured = capsys.readouterr()
        assert (captured.out, captured.err) == ("", "")
