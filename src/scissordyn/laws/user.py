"""A user's own law: a plain Python function, compiled and called by its address."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from scissordyn.laws.contact import JointContact
from scissordyn.plugin.pointer import USER
from scissordyn.plugin.user_compile import Function, probe, row
from scissordyn.plugin.user_file import pinned

__all__ = ["UserDamping", "UserElastic", "UserFriction"]

INDENTATIONS = tuple(np.logspace(-9, -3, 13).tolist())
RATES = (-10.0, -0.5, -1e-4, 0.0, 1e-4, 0.5, 10.0)
APPROACHES = (1e-6, 1e-2, 1.0, 10.0)
FORCES = (0.0, 1.0, 1e3, 1e6)
SPEEDS = (*(-np.logspace(1, -9, 11)).tolist(), 0.0, *np.logspace(-9, 1, 11).tolist())
"""Where a law is tried: 1 nm to 1 mm, rest to 10 m/s either way, no force to 1 MN."""


@dataclass(frozen=True)
class UserElastic:
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
        If the function cannot be compiled, raises, or gives no finite number between 1 nm and 1 mm.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    name: ClassVar[str] = "user"
    kernel_kind: ClassVar[int] = USER
    source: ClassVar[str] = "the user"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", pinned(self.function, self.digest))
        grid = ((delta,) for delta in INDENTATIONS)
        probe("stiffness law", self.function, self.digest, self.constants, ("indentation",), grid)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Address of the compiled function in this process, then the constants."""
        return row("stiffness law", self.function, self.digest, self.constants, ("indentation",))


@dataclass(frozen=True)
class UserDamping:
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
        If the function cannot be compiled, raises, or gives no finite number up to 1 MN, 1 mm and 10 m/s.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    name: ClassVar[str] = "user"
    kernel_kind: ClassVar[int] = USER
    source: ClassVar[str] = "the user"
    restitution_range: ClassVar[tuple[float, float] | None] = None
    leading: ClassVar[tuple[str, ...]] = ("elastic", "indentation", "rate", "approach")

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", pinned(self.function, self.digest))
        grid = itertools.product(FORCES, INDENTATIONS[::3], RATES, APPROACHES)
        probe("damping law", self.function, self.digest, self.constants, self.leading, grid)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Address of the compiled function in this process, then the constants."""
        return row("damping law", self.function, self.digest, self.constants, self.leading)


@dataclass(frozen=True)
class UserFriction:
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
        If the function cannot be compiled, raises, or gives no finite number up to 10 m/s and 1 MN.
    """

    function: Function | str
    constants: tuple[float, ...] = ()
    digest: str = ""

    name: ClassVar[str] = "user"
    kernel_kind: ClassVar[int] = USER
    source: ClassVar[str] = "the user"
    states: ClassVar[tuple[str, ...]] = ()
    stiff: ClassVar[bool] = True
    leading: ClassVar[tuple[str, ...]] = ("slip_speed", "normal_force")

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", pinned(self.function, self.digest))
        probe("friction law", self.function, self.digest, self.constants, self.leading, itertools.product(SPEEDS, FORCES))

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Address of the compiled function in this process, then the constants."""
        return row("friction law", self.function, self.digest, self.constants, self.leading)
