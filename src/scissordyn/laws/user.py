"""A user's own law as a plain Python function, the short form of an element."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.plugin.element import addresses, row_of
from scissordyn.plugin.short_form import Function, ShortForm, answers

INDENTATIONS = tuple(np.logspace(-9, -3, 13).tolist())
APPROACHES = (1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0)
RATES = (*(-np.logspace(1, -6, 8)).tolist(), 0.0, *np.logspace(-6, 1, 8).tolist())
FORCES = (0.0, *np.logspace(-3, 6, 10).tolist())
SPEEDS = (*(-np.logspace(1, -9, 11)).tolist(), 0.0, *np.logspace(-9, 1, 11).tolist())
"""Where a law is tried: 1 nm to 1 mm, rest to 10 m/s either way, no force to 1 MN."""

DEPTHS = np.unique(np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 61), np.linspace(0.0, 1.0, 65)[1:]]))
"""Where a stiffness law is tried in its joint, in clearances (in corner radii at a plane guide surface)."""

AT_TOUCH = 1e-6
"""A stiffness law may have this fraction of its force at one clearance left at the touch, for rounding."""

ROUNDING = 1e-12
"""By which a force may fall short of what it should be."""

LARGEST_COEFFICIENT = 10.0
"""Above this, F_t/F_n is worth a warning; the bound of the built-in laws."""


def _reach(joint: JointContact) -> tuple[float, str]:
    """How deep a law is tried in a joint [m], and what that depth is called."""
    return (joint.journal_radius, "corner radius") if joint.plane else (joint.clearance, "clearance")


def _depths(joint: JointContact) -> tuple[float, ...]:
    """Indentations at which a damping law is tried in a joint [m]."""
    return tuple((np.geomspace(1e-6, 1.0, 7) * _reach(joint)[0]).tolist())


def _of_stiffness(force: np.ndarray, joint: JointContact) -> list[str]:
    """What is doubtful about elastic forces [N] at `DEPTHS`."""
    size, what = _reach(joint)
    falls = np.flatnonzero(np.diff(force) <= 0.0)
    if not falls.size:
        return []
    low, high = 1e3 * size * DEPTHS[falls[0]], 1e3 * size * DEPTHS[falls[0] + 1]
    return [f"the force does not grow from {low:.4g} mm to {high:.4g} mm of indentation (tried up to the {what})"]


def _of_damping(force: np.ndarray) -> list[str]:
    """What is doubtful about normal forces [N], shape (FORCES, depths, RATES, APPROACHES)."""
    elastic = np.array(FORCES)[:, None, None, None]
    rate = np.array(RATES)[None, None, :, None]
    # what the kernels make of a pull
    gain = (elastic - np.maximum(force, 0.0)) * np.sign(rate)
    if not np.any(gain > ROUNDING * (1.0 + elastic)):
        return []
    at = np.unravel_index(int(np.argmax(gain)), gain.shape)
    what = "lowers the elastic force on approach" if RATES[at[2]] > 0.0 else "raises the elastic force on rebound"
    return [f"it {what} ({FORCES[at[0]]:g} N at {RATES[at[2]]:g} m/s), so that contacts may gain energy"]


def _of_friction(given: np.ndarray) -> list[str]:
    """What is doubtful about tangential forces [N], shape (SPEEDS, FORCES)."""
    force, doubts = np.abs(given), []
    if np.any(force[:, 0] > 0.0):
        doubts.append("it gives a force where the normal force is zero")
    largest = float(np.max((force[:, 1:] - force[:, :1]) / np.array(FORCES[1:])))
    if largest > LARGEST_COEFFICIENT:
        doubts.append(f"its friction coefficient reaches {largest:.3g} at 10 m/s or less")
    return doubts


def element_doubts(law: Any, joint: JointContact) -> list[str]:
    """What is doubtful about a user's law in a joint, one clause each; nothing is known of a law with states."""
    if isinstance(law, Friction) and law.states:
        return []
    if isinstance(law, Elastic):
        points: Any = DEPTHS[:, None] * _reach(joint)[0]
    elif isinstance(law, Damping):
        points = list(itertools.product(FORCES, _depths(joint), RATES, APPROACHES))
    else:
        points = list(itertools.product(SPEEDS, FORCES))
    points = np.array(points, float)
    forces = answers(addresses(law)["force"], points, row_of(law, joint))
    if not np.all(np.isfinite(forces)):
        first = points[~np.isfinite(forces)][0]
        at = ", ".join(f"{name} = {value:g}" for name, value in zip(law.slot.inputs, first, strict=True))
        return [f"it gives no finite number at {at}"]
    if isinstance(law, Damping):
        return _of_damping(forces.reshape(len(FORCES), -1, len(RATES), len(APPROACHES)))
    if isinstance(law, Friction):
        drives = forces * points[:, 0] < 0.0
        against = ["it drives the slip: its force is against the sign of the slip speed"] if np.any(drives) else []
        return against + _of_friction(forces.reshape(len(SPEEDS), len(FORCES)))
    pulls = ["it pulls"] if np.any(forces < 0.0) else []
    touch = ["it has a force without indentation"] if abs(forces[0]) > AT_TOUCH * abs(forces[-1]) else []
    return pulls + touch + _of_stiffness(forces, joint)


@dataclass(frozen=True)
class UserElastic(ShortForm, Elastic):
    """An elastic part of the user's own.

    Parameters
    ----------
    function : callable or str
        ``f(indentation, *constants)``, from m to N; or ``"file.py:f"``.
    constants : tuple of float
        Further arguments of the function.
    digest : str
        Of the file that holds the function, so that a saved run cannot silently run an edited law; that of the file as it is
        now if not given.

    Raises
    ------
    InputError
        If the function cannot be compiled, raises, or gives no finite number between 1 nm and 1 mm; in a joint also if it pulls
        anywhere up to the clearance, or has a force without indentation.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.probe((delta,) for delta in INDENTATIONS)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The constants; the law is tried up to the clearance first."""
        self._forces(joint)
        return super().parameters()

    def _forces(self, joint: JointContact) -> np.ndarray:
        """Its force at `DEPTHS`, refused where it cannot be right [N]."""
        size, what = _reach(joint)
        (deepest,) = self.probe([(size,)], lambda _, force: force > 0.0, f"a push at one {what}: above 0 N")
        return self.probe(
            [(float(depth) * size,) for depth in DEPTHS],
            right=lambda point, force: force >= 0.0 if point[0] > 0.0 else abs(force) <= AT_TOUCH * deepest,
            allowed=f"a push up to the {what}: 0 N or more, and 0 N at 0 m",
        )

    def doubts(self, joint: JointContact) -> list[str]:
        """What is doubtful about the law in a joint, one clause each.

        Parameters
        ----------
        joint : JointContact

        Returns
        -------
        list of str
        """
        return _of_stiffness(self._forces(joint), joint)


@dataclass(frozen=True)
class UserDamping(ShortForm, Damping):
    """A damping part of the user's own: the whole normal force, which is cut off at zero.

    Parameters
    ----------
    function : callable or str
        ``f(elastic, indentation, rate, approach, *constants)``, from N, m, m/s, m/s to N; or ``"file.py:f"``.
    constants : tuple of float
        Further arguments of the function.
    digest : str
        Of the file that holds the function, so that a saved run cannot silently run an edited law; that of the file as it is
        now if not given.

    Raises
    ------
    InputError
        If the function cannot be compiled, raises, or gives no finite number up to 1 MN, 1 mm (in a joint: its clearance)
        and 10 m/s.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._forces(INDENTATIONS[::3])

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The constants; the law is tried up to the clearance first."""
        self._forces(_depths(joint))
        return super().parameters()

    def _forces(self, depths: tuple[float, ...]) -> np.ndarray:
        """Normal forces [N], shape (FORCES, depths, RATES, APPROACHES)."""
        return self.probe(itertools.product(FORCES, depths, RATES, APPROACHES)).reshape(
            len(FORCES), len(depths), len(RATES), len(APPROACHES)
        )

    def doubts(self, joint: JointContact) -> list[str]:
        """What is doubtful about the law in a joint, one clause each.

        Parameters
        ----------
        joint : JointContact

        Returns
        -------
        list of str
        """
        return _of_damping(self._forces(_depths(joint)))


@dataclass(frozen=True)
class UserFriction(ShortForm, Friction):
    """A friction law of the user's own, without internal states.

    Parameters
    ----------
    function : callable or str
        ``f(slip_speed, normal_force, *constants)``, from m/s and N to N, of the sign of the slip speed; or ``"file.py:f"``.
    constants : tuple of float
        Further arguments of the function.
    digest : str
        Of the file that holds the function, so that a saved run cannot silently run an edited law; that of the file as it is
        now if not given.

    Raises
    ------
    InputError
        If the function cannot be compiled, raises, gives no finite number up to 10 m/s and 1 MN, or a force against the sign of
        the slip speed, which would drive the surfaces.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._forces()

    def _forces(self) -> np.ndarray:
        """Tangential forces [N], shape (SPEEDS, FORCES), refused where they drive the slip."""
        forces = self.probe(
            itertools.product(SPEEDS, FORCES),
            right=lambda point, force: force * point[0] >= 0.0,
            allowed="a force of the sign of the slip speed, or 0 N",
        )
        return forces.reshape(len(SPEEDS), len(FORCES))

    def doubts(self, joint: JointContact) -> list[str]:
        """What is doubtful about the law, one clause each.

        Parameters
        ----------
        joint : JointContact

        Returns
        -------
        list of str
        """
        return _of_friction(self._forces())
