"""Estimates of the memory and time that runs and studies need; the checks refuse what does not fit before anything starts."""

from __future__ import annotations

import os
from contextlib import suppress
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError

if TYPE_CHECKING:
    from scissordyn.plan.plan import Plan

FLOAT_BYTES = np.dtype(float).itemsize  # [bytes] size of one floating-point number
CYCLE_TIME = Decimal("0.001")  # [s] time to compute one cycle of a small mechanism
UNKNOWN_MEMORY = 2**36  # [bytes] assumed memory if the system does not report its memory

CONTAINER_LIMIT = Path("/sys/fs/cgroup/memory.max")  # memory limit of a container on Linux
MEMORY_INFO = Path("/proc/meminfo")  # free memory on Linux


def machine_memory() -> int:
    """Return the memory [bytes] of this machine, of its container, or of the limit on this process, whichever is smallest."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):  # Windows has no sysconf
        memory = UNKNOWN_MEMORY
    with suppress(OSError, ValueError):  # not in a container, or its limit is "max"
        memory = min(memory, int(CONTAINER_LIMIT.read_text(encoding="ascii")))
    return min(memory, _address_space())


def free_memory() -> int:
    """Return the memory available to this process [bytes], or all memory if the system does not report what is free."""
    try:
        line = next(line for line in MEMORY_INFO.read_text(encoding="ascii").splitlines() if line.startswith("MemAvailable:"))
        return min(machine_memory(), 1024 * int(line.split()[1]))
    except (OSError, ValueError, StopIteration, IndexError):
        return machine_memory()


def _address_space() -> int:
    """Return the largest address space of this process [bytes], as set by `ulimit -v`."""
    try:
        import resource
    except ImportError:  # Windows has no resource module
        return UNKNOWN_MEMORY
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return UNKNOWN_MEMORY if limit == resource.RLIM_INFINITY else limit


def format_count(count: int) -> str:
    """Write a count in full, or to four digits if it has more than nine."""
    return str(count) if count < 10**9 else f"{Decimal(count):.4g}"


def format_bytes(count: int) -> str:
    """Write a number of bytes in MB, GB or TB."""
    for unit, factor in (("TB", 10**12), ("GB", 10**9)):
        if count >= factor:
            return f"{Decimal(count) / factor:.3g} {unit}"
    return f"{Decimal(count) / 10**6:.3g} MB"


def format_duration(seconds: float | Decimal) -> str:
    """Write a time in seconds, minutes, hours, days or years."""
    for unit, factor in (("years", 31_557_600), ("days", 86_400), ("hours", 3600), ("minutes", 60)):
        if seconds >= 2 * factor:
            return f"{Decimal(seconds) / factor:.3g} {unit}"
    return f"{Decimal(seconds):.3g} s"


def check_memory(
    what: str, needed: int, seconds: float | Decimal, allowed: str, example: str = "", *, here: int | None = None
) -> None:
    """Raise `InputError` if `needed` exceeds `here`, the available memory [bytes]; by default, the machine's memory."""
    free, here = ("" if here is None else " free"), machine_memory() if here is None else here
    if needed > here:
        raise InputError(
            f"{what} take {format_bytes(needed)} of memory and {format_duration(seconds)} of a processor; "
            f"this machine has {format_bytes(here)}{free}",
            allowed,
            example,
        )


def check_samples(plan: Plan, samples: int) -> None:
    """Raise `InputError` if the samples of a run do not fit into the free memory.

    Measured peaks of examples/paper.toml, four_bar.toml and mast.toml with 200 000 samples are 0.97 to 1.04 of the estimate.
    """
    joints, here = len(plan.mechanism.joint_names), free_memory()
    whole = 25  # values per sample: time, energies, drives, ends of the structure
    body = 14  # values per sample and body: motion, direction, load
    joint = 2 + (6 if plan.contacts else 0)  # values per sample and joint: reaction, and contact variables
    copies = 2  # a run is in memory as arrays and as the file made of them
    record_seconds = 2e-7  # [s] time to record one value; 150 to 250 us for the 1000 to 1800 values of 40 units
    numbers = whole + body * len(plan.bodies) + joint * joints
    needed = copies * FLOAT_BYTES * numbers
    check_memory(
        f"{samples} samples of {len(plan.bodies)} bodies and {joints} joints",
        needed * samples,
        record_seconds * numbers * samples,
        f"at most {here // needed} samples",
        "samples = 2001",
        here=here,
    )


def check_cycles(contacts: int, cycles: int) -> None:
    """Raise `InputError` if the values of all cycles (10 each, and 4 of each contact) do not fit into the memory."""
    needed = FLOAT_BYTES * (10 + 4 * contacts)
    check_memory(
        f"{format_count(cycles)} cycles",
        needed * cycles,
        CYCLE_TIME * cycles,
        f"at most {machine_memory() // needed} cycles here",
        "fewer cycles",
    )


def check_cases(points: int, samples: int, members: int, numbers: int) -> None:
    """Raise `InputError` if the cases of a study do not fit into the memory.

    At the peak a case takes 110 numbers as Python objects, and 3 copies of each of its values and measures. Measured: 960 bytes
    for 2 values and 2 measures, 1070 to 1320 bytes for 2 and 8.
    """
    case_time = Decimal("0.001")  # [s] time to compute a short case
    cases, needed = points * samples * members, FLOAT_BYTES * (110 + 3 * numbers)
    named = (("points", points), ("samples of each", samples), ("members of each", members))
    factors = [f"{format_count(count)} {name}" for name, count in named if count > 1]
    check_memory(
        f"{format_count(cases)} cases ({', '.join(factors)})",
        needed * cases,
        case_time * cases,
        f"at most {machine_memory() // needed} cases",
        "fewer values, --points, --samples or --members",
    )
