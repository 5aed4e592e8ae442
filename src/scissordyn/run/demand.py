"""Memory and time that runs and studies take, found before they are begun: what cannot be is refused at once."""

from __future__ import annotations

import os
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.plan.plan import Plan

NUMBER = 8  # Bytes of a floating-point number
RECORDED = 2e-7  # Time to record a number of a sample [s]: 150 to 250 us for the 1000 to 1800 numbers of arrays of 40 units

BODY, JOINT, CONTACT_JOINT = 14, 2, 6
"""Numbers of a sample: of a body its motion, direction and load; of a joint its reaction; of all joints if one is loose."""

CYCLE, CYCLE_CONTACT = 10, 4  # Numbers that are kept of each cycle of a drive, and of each of its contacts
CYCLE_TIME = Decimal("0.001")  # Time of a cycle of a small mechanism [s]

CASE_NUMBERS = 5
"""Numbers of eight bytes that are held of a case beside its values and measures: number, status, member, cause, warnings."""

CASE_TIME = Decimal("0.001")  # Time of a short case [s], by which the time of studies is estimated that nobody has begun
UNKNOWN = 2**36  # Memory that is assumed where a system does not tell [bytes]

CONTAINER = Path("/sys/fs/cgroup/memory.max")


def machine_memory() -> int:
    """Memory of this machine, or of the container that this process is in [bytes]."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # not on Windows
        memory = UNKNOWN
    try:
        return min(memory, int(CONTAINER.read_text(encoding="ascii")))
    except (OSError, ValueError):  # no container, or "max"
        return memory


def count_in_words(count: int) -> str:
    """A whole number of any length, to four digits if it has more than nine."""
    return str(count) if count < 10**9 else f"{Decimal(count):.4g}"


def size(count: int) -> str:
    for unit, factor in (("TB", 10**12), ("GB", 10**9)):
        if count >= factor:
            return f"{Decimal(count) / factor:.3g} {unit}"
    return f"{Decimal(count) / 10**6:.3g} MB"


def duration(seconds: float | Decimal) -> str:
    for unit, factor in (("years", 31_557_600), ("days", 86_400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * factor:
            return f"{Decimal(seconds) / factor:.3g} {unit}"
    return f"{Decimal(seconds):.3g} s"


def check_memory(what: str, needed: int, seconds: float | Decimal, allowed: str, type_this: str = "") -> None:
    here = machine_memory()
    if needed > here:
        raise InputError(
            f"{what} take {size(needed)} of memory and {duration(seconds)} of a processor; this machine has {size(here)}",
            allowed,
            type_this,
        )


def check_samples(plan: Plan, samples: int) -> None:
    joints = len(plan.mechanism.joint_names)
    numbers = BODY * len(plan.bodies) + (JOINT + (CONTACT_JOINT if plan.contacts else 0)) * joints
    most = machine_memory() // (NUMBER * numbers)
    check_memory(
        f"{samples} samples of {len(plan.bodies)} bodies and {joints} joints",
        NUMBER * numbers * samples,
        RECORDED * numbers * samples,
        f"at most {most} samples",
        "samples = 2001",
    )


def check_cycles(contacts: int, cycles: int) -> None:
    needed = NUMBER * (CYCLE + CYCLE_CONTACT * contacts)
    check_memory(
        f"{count_in_words(cycles)} cycles",
        needed * cycles,
        CYCLE_TIME * cycles,
        f"at most {machine_memory() // needed} cycles here",
        "fewer cycles",
    )


def check_cases(points: int, samples: int, members: int, numbers: int) -> None:
    cases, needed = points * samples * members, NUMBER * (CASE_NUMBERS + numbers)
    named = (("points", points), ("samples of each", samples), ("members of each", members))
    factors = [f"{count_in_words(count)} {name}" for name, count in named if count > 1]
    check_memory(
        f"{count_in_words(cases)} cases ({', '.join(factors)})",
        needed * cases,
        CASE_TIME * cases,
        f"at most {machine_memory() // needed} cases",
        "fewer values, --points, --samples or --members",
    )
