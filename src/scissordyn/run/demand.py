"""Memory and time that runs and studies take, found before they are begun: what cannot be is refused at once."""

from __future__ import annotations

import os
from contextlib import suppress
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.plan.plan import Plan

NUMBER = 8  # Bytes of a floating-point number
RECORDED = 2e-7  # Time to record a number of a sample [s]: 150 to 250 us for the 1000 to 1800 numbers of arrays of 40 units

BODY, JOINT, CONTACT_JOINT, WHOLE = 14, 2, 6, 25
"""Numbers of a sample: of a body its motion, direction and load; of a joint its reaction; of all joints if one is loose; of the
whole mechanism time, energies, drives and the ends of the structure."""

COPIES = 2
"""How often a run is in memory at its peak: as arrays, and as the file that is made of them. The measured peaks of
examples/paper.toml, four_bar.toml and mast.toml with 200 000 samples are 0.97 to 1.04 of the estimate."""

CYCLE, CYCLE_CONTACT = 10, 4  # Numbers that are kept of each cycle of a drive, and of each of its contacts
CYCLE_TIME = Decimal("0.001")  # Time of a cycle of a small mechanism [s]

CASE_NUMBERS, CASE_COPIES = 110, 3
"""Memory of a case at the peak of a study, in numbers of eight bytes: as Python objects while it is read and concluded from,
and copies of each of its values and measures. Measured: 960 bytes for 2 values and 2 measures, 1070 to 1320 for 2 and 8."""

CASE_TIME = Decimal("0.001")  # Time of a short case [s], by which the time of studies is estimated that nobody has begun
UNKNOWN = 2**36  # Memory that is assumed where a system does not tell [bytes]

CONTAINER = Path("/sys/fs/cgroup/memory.max")


FREE = Path("/proc/meminfo")


def machine_memory() -> int:
    """Memory of this machine, or of the container or the limit that this process is in [bytes]."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # not on Windows
        memory = UNKNOWN
    with suppress(OSError, ValueError):  # no container, or "max"
        memory = min(memory, int(CONTAINER.read_text(encoding="ascii")))
    return min(memory, _address_space())


def free_memory() -> int:
    """Memory that this machine can still give to this process [bytes]; all of it where the system does not tell."""
    try:
        line = next(line for line in FREE.read_text(encoding="ascii").splitlines() if line.startswith("MemAvailable:"))
        return min(machine_memory(), 1024 * int(line.split()[1]))
    except (OSError, ValueError, StopIteration, IndexError):
        return machine_memory()


def _address_space() -> int:
    """Largest address space of this process [bytes], as `ulimit -v` sets it."""
    try:
        import resource
    except ImportError:  # not on Windows
        return UNKNOWN
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return UNKNOWN if limit == resource.RLIM_INFINITY else limit


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


def check_memory(
    what: str, needed: int, seconds: float | Decimal, allowed: str, type_this: str = "", *, here: int | None = None
) -> None:
    """Raise `InputError` if something needs more memory than there is here, by default that of the machine."""
    free, here = ("" if here is None else " free"), machine_memory() if here is None else here
    if needed > here:
        raise InputError(
            f"{what} take {size(needed)} of memory and {duration(seconds)} of a processor; this machine has {size(here)}{free}",
            allowed,
            type_this,
        )


def check_samples(plan: Plan, samples: int) -> None:
    joints, here = len(plan.mechanism.joint_names), free_memory()
    numbers = WHOLE + BODY * len(plan.bodies) + (JOINT + (CONTACT_JOINT if plan.contacts else 0)) * joints
    needed = COPIES * NUMBER * numbers
    check_memory(
        f"{samples} samples of {len(plan.bodies)} bodies and {joints} joints",
        needed * samples,
        RECORDED * numbers * samples,
        f"at most {here // needed} samples",
        "samples = 2001",
        here=here,
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
    cases, needed = points * samples * members, NUMBER * (CASE_NUMBERS + CASE_COPIES * numbers)
    named = (("points", points), ("samples of each", samples), ("members of each", members))
    factors = [f"{count_in_words(count)} {name}" for name, count in named if count > 1]
    check_memory(
        f"{count_in_words(cases)} cases ({', '.join(factors)})",
        needed * cases,
        CASE_TIME * cases,
        f"at most {machine_memory() // needed} cases",
        "fewer values, --points, --samples or --members",
    )
