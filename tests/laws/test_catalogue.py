"""Catalogue of laws: names, kernels, declarations and sources."""

import math
import re

import numpy as np
import pytest
from bouncing import JOINT, at, row

import scissordyn as sd
from scissordyn.laws import catalogue
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping import proportional
from scissordyn.laws.evaluate import friction_force
from scissordyn.plugin.element import ELEMENT_PARAMETERS_MAX
from scissordyn.units import quantities

KINDS = {"stiffness": Elastic, "damping": Damping, "friction": Friction}  # Base class of the laws of each kind
ENTRIES = [(kind, name) for kind, laws in catalogue.BY_KIND.items() for name in laws]  # Pairs of kind and name of all laws


def test_names_of_all_laws():
    """Contract: the catalogue holds exactly the laws of this list."""
    assert set(catalogue.ELASTIC) == {
        *("bai-zhao-as-printed", "braendlein", "dubowsky-freudenstein", "esdu-78035", "hertz", "johnson"),
        *("linear", "liu", "pereira", "persson", "power", "radzimovsky"),
    }
    assert set(catalogue.DAMPING) == {
        *("anagnostopoulos", "carvalho-martins", "exact", "flores", "gonthier", "herbert-mcwhannell", "hu-guo"),
        *("hunt-crossley", "kelvin-voigt", "lankarani-nikravesh", "lee-wang", "none", "safaeifar-farshidianfar"),
        *("standard-linear-solid", "zhiying-qishao"),
    }
    assert set(catalogue.FRICTION) == {
        *("ambrosio", "bengisu-akay", "brown-mcphee", "coulomb", "dahl", "elasto-plastic", "gonthier-bristle"),
        *("lugre", "maxwell-slip", "none", "stribeck", "threlfall"),
    }


@pytest.mark.parametrize(("kind", "name"), ENTRIES)
def test_declaration_of_each_law(kind, name):
    """Contract: every law satisfies its protocol, fits in its row and has a name, source, units and help."""
    law = catalogue.law(kind, name)
    assert isinstance(law(), KINDS[kind])
    assert len(law().parameters(JOINT)) <= ELEMENT_PARAMETERS_MAX
    assert law.name == name
    assert len(law.__doc__.strip().splitlines()[0]) > 10
    assert re.search(r"doi:|\d{4}|definition", law.source)
    for key, quantity in quantities(law).items():
        default = law.__dataclass_fields__[key].default
        assert quantity.help
        assert default is None or quantity.admits(default)
    if kind == "damping" and law.declaration.kernels["force"] is proportional.force and name != "none":
        assert isinstance(law(), proportional.DampingFactor)


def test_friction_states():
    """Contract: laws with memory declare their states and units."""
    assert {
        name: tuple((state.name, state.unit) for state in law.states) for name, law in catalogue.FRICTION.items() if law.states
    } == {
        "dahl": (("bristle_deflection", "m"),),
        "elasto-plastic": (("bristle_deflection", "m"),),
        "gonthier-bristle": (("bristle_deflection", "m"), ("dwell", "1")),
        "lugre": (("bristle_deflection", "m"),),
        "maxwell-slip": (("first_deflection", "m"), ("second_deflection", "m")),
    }


@pytest.mark.parametrize(
    ("kind", "name", "says"),
    [
        ("stiffness", "lui", "did you mean 'liu'"),
        ("damping", "florez", "did you mean 'flores'"),
        ("damper", "flores", "damping"),
    ],
)
def test_unknown_names(kind, name, says):
    """Contract: the error about an unknown name suggests the nearest one."""
    with pytest.raises(sd.InputError, match=says):
        catalogue.law(kind, name)


def test_materials():
    """Published number: E* of steel on steel is 113.7363 GPa (docs/reference.md); every material has plausible values."""
    assert JOINT.modulus == pytest.approx(1.137363e11, rel=1e-6)
    materials = catalogue.MATERIALS
    assert {"steel", "aluminium", "titanium", "bronze", "ptfe", "cfrp"} <= set(materials)
    for name, material in materials.items():
        assert material.name == name
        assert material.source
        # the speed of sound in a thin rod, from PTFE's 480 m/s to the 7 km/s of carbon fibre
        assert 400.0 < math.sqrt(material.youngs_modulus / material.density) < 7000.0


# Kind and name of a law, name and quantity of a parameter, for all laws
PARAMETERS_OF_LAWS = [(kind, name, *entry) for kind, name in ENTRIES for entry in quantities(catalogue.law(kind, name)).items()]


@pytest.mark.parametrize(("kind", "name", "key", "quantity"), PARAMETERS_OF_LAWS)
def test_parameters_are_bounded(kind, name, key, quantity):
    """Contract: every parameter has a lower and an upper bound; values outside and infinite ones are refused by name."""
    low = quantity.minimum if quantity.above is None else quantity.above
    high = quantity.maximum if quantity.below is None else quantity.below
    assert low < high
    law = catalogue.law(kind, name)
    for value in (1e308, -1e308, math.inf, math.nan, -5e-324, *((5e-324,) if low > 0.0 else ())):
        with pytest.raises(sd.InputError, match=rf"{key} = .*expected a number (from|>)"):
            law(**{key: value})
    for value in (low, high):
        other = {"kinetic": value} if key == "static" else {}
        other |= {"static": value} if key == "kinetic" and "static" in law.__dataclass_fields__ else {}
        other |= {"full_speed": 10.0} if key == "dead_speed" and value < 10.0 else {}
        other |= {"dead_speed": 0.0} if key == "full_speed" else {}
        if quantity.admits(value) and (key, value) != ("dead_speed", 10.0):
            numbers = law(**{key: value, **other}).parameters(JOINT)
            assert all(math.isfinite(number) for number in numbers)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("youngs_modulus", 999.0),
        ("youngs_modulus", 1.1e13),
        ("poisson_ratio", -1.0),
        ("poisson_ratio", 0.51),
        ("density", 0.0),
        ("density", 1e6),
    ],
)
def test_materials_are_bounded(field, value):
    """Contract: moduli are 1 kPa to 10 TPa, Poisson's ratios above -1 up to 0.5, densities 0.1 to 1e5 kg/m^3."""
    given = {"youngs_modulus": 2e11, "poisson_ratio": 0.3, "density": 7800.0, field: value}
    with pytest.raises(sd.InputError, match=field):
        catalogue.MATERIALS["steel"].__class__("odd", **given)


def test_kernel_refuses_states_that_are_not_contiguous():
    """Contract: a kernel reads contiguous states; a column of a table is refused."""
    law = catalogue.FRICTION["gonthier-bristle"]()
    apart = np.ones((2, 3))[:, 0]
    with pytest.raises(TypeError, match="contiguous"):
        friction_force(at(law), 0.1, 1.0, apart, np.zeros(2), row(law))
