"""Texts of a case that are fields of the form: section, material and oil."""

from __future__ import annotations

from pathlib import Path

import pytest

from scissordyn.component.flexible_bar import FlexibleBar
from scissordyn.errors import InputError
from scissordyn.explore.answers import differences
from scissordyn.explore.case import open_case

BENDING = """
[structure]
kind = "scissor"
bars = { section = "tube 60x60x1.56 mm", material = "steel" }
[drive]
speed = "60 rpm"
[[clearance]]
joint = "A"
clearance = "0.5 mm"
lubrication = { oil = "ISO VG 46", temperature = "50 degC" }
[run]
until = "1 ms"
"""


def test_section_material_and_oil_are_fields(tmp_path: Path) -> None:
    """Contract: texts with what is allowed, temperatures in kelvin, and a case that changes with them."""
    (tmp_path / "case.toml").write_text(BENDING, encoding="utf-8")
    case = open_case(tmp_path / "case.toml")
    plain = {each["key"]: each for each in (field.plain() for field in case.fields)}
    oil, warm = plain["clearance.0.lubrication.oil"], plain["clearance.0.lubrication.temperature"]
    assert (oil["text"], oil["slider"]) == ("ISO VG 46", None)
    assert "ISO VG 32" in oil["allowed"]
    assert (warm["text"], warm["unit"], warm["factor"]) == ("323.15 K", "K", 1.0)
    texts = {
        "structure.bars.section": "tube 60x60x2 mm",
        "structure.bars.material": "aluminium",
        "clearance.0.lubrication.oil": "ISO VG 32",
        "clearance.0.lubrication.temperature": "40 degC",
    }
    changed = case.changed(texts)
    lubrication = changed.mechanism.joint("A").clearance.lubrication
    assert (lubrication.oil.name, lubrication.temperature) == ("ISO VG 32", pytest.approx(313.15))
    mass = [
        sum(body.mass for body in each.mechanism.bodies if body.name.startswith("unit 1/bar 1")) for each in (case, changed)
    ]
    assert mass[1] / mass[0] == pytest.approx(2700.0 / 7850.0 * (60.0**2 - 56.0**2) / (60.0**2 - 56.88**2))
    assert 'material = "aluminium"' in changed.text()
    assert differences([case, changed])[1].startswith(
        "structure, bars section tube 60x60x2 mm, structure, bars material aluminium"
    )
    more = case.changed({"structure.bars.modes": "3"})
    assert (case.field("structure.bars.modes").text, more.field("structure.bars.modes").text) == ("auto", "3")
    assert {part.modes for part in more.mechanism.components if isinstance(part, FlexibleBar)} == {3}
    with pytest.raises(InputError, match="wall"):
        case.changed({"structure.bars.section": "tube 60x60x40 mm"})
