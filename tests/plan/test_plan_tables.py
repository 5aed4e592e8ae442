"""Tables of plans that fit each other, for every kind of component and each of its fields."""

import dataclasses

import numpy as np
import pytest
from scipy.sparse import issparse
from tests.test_attached_to_bars import ATTACHED, STIFF, bars

import scissordyn as sd
from scissordyn.laws.catalogue import DAMPING, FRICTION
from scissordyn.plan.plan import compiled

TABLES = ("coordinates", "model", "maps", "balance", "angles")  # Fields of a plan that are tables


def leaves(value, path):
    """Yield every array, number and text in nested tables, with its path; a sparse matrix as its arrays."""
    if issparse(value):
        value = value.tocsr()
        yield from ((f"{path}.{name}", getattr(value, name).tobytes()) for name in ("indptr", "indices", "data"))
    elif isinstance(value, np.ndarray):
        yield path, (value.shape, value.tobytes())
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from leaves(getattr(value, field.name), f"{path}.{field.name}")
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}[{key}]")
    elif isinstance(value, list | tuple):
        yield path, len(value)
        for k, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{k}]")
    elif isinstance(value, int | float | str | None):
        yield path, repr(value)


def entries(plan):
    """Return all entries of the tables of a plan."""
    return {path: entry for name in TABLES for path, entry in leaves(getattr(plan, name), name)}


def variations(part):
    """Yield a component with one field changed: numbers by a quarter, an absent time function added."""
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        changes = {}
        if field.name == "time_function" and value is None:
            changes[field.name] = sd.Cycloidal(0.5, 1.0, 0.5)
        elif isinstance(value, float):
            changes[field.name] = 1.25 * value if value else 0.25
        elif isinstance(value, bool):
            changes[field.name] = not value
        try:
            if changes:
                yield field.name, dataclasses.replace(part, **changes)
        except sd.InputError:
            continue  # the field is tied to another one


@pytest.mark.parametrize("bent", [False, True], ids=["rigid", "bent"])
@pytest.mark.parametrize("name", list(ATTACHED))
def test_plans_that_fit_have_equal_tables(name, bent):
    """Identity: for a change of any field of a component, a plan that fits has the tables of a compiled one."""
    made = ATTACHED[name](bars())
    made = sd.with_bending(made, "arm", modes=2, **STIFF) if bent else made
    known = compiled(made)
    expected = entries(known)
    assert len(expected) > 100
    for k, part in enumerate(made.components):
        for field, changed in variations(part):
            components = (*made.components[:k], changed, *made.components[k + 1 :])
            try:
                other = dataclasses.replace(made, components=components)
                found = compiled(other)
            except sd.InputError:
                continue
            if known.fits(other):
                wrong = [path for path, entry in entries(found).items() if expected.get(path) != entry]
                assert not wrong, (type(part).__name__, field, wrong[:5])


def clearances():
    """Yield clearances with every friction law and every damping law, compliant, hard and with oil."""
    for catalogue, slot in ((FRICTION, "friction"), (DAMPING, "damping")):
        for law in catalogue.values():
            for given in ({}, {"kinetic": 0.1}, {"restitution": 0.9}):
                try:
                    chosen = {slot: law(**given)}
                except (sd.InputError, TypeError):
                    continue
                yield sd.Clearance(5e-4, **chosen)
                break
    yield sd.Clearance(5e-4, contact="hard", damping=sd.Flores(0.7))
    yield sd.Clearance(5e-4, reference="onset")
    yield sd.Clearance(5e-4, lubrication=sd.Lubrication(viscosity=0.05))


def test_clearances_that_fit_have_equal_tables():
    """Identity: plans that fit have equal tables for every pair of laws in a joint."""
    made = [compiled(bars().with_clearance("elbow", clearance)) for clearance in clearances()]
    assert len(made) > 20
    found = [entries(plan) for plan in made]
    for one, first in zip(made, found, strict=True):
        for other, second in zip(made, found, strict=True):
            if one.fits(other.mechanism):
                assert first == second, (one.clearances, other.clearances)
