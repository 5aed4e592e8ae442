"""Run short versions of several benchmarks, or one in full by its name."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

from benchmarks import batches, scaling, speed, start_up
from benchmarks.measure import command, machine

NAMED = sorted(
    path.stem for path in Path(__file__).parent.glob("*.py") if "\ndef measure(quick" in path.read_text(encoding="utf-8")
)

if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
    name = sys.argv.pop(1)
    if name not in NAMED:
        sys.exit(f"no benchmark '{name}'; expected {', '.join(NAMED)}")
    command(name, import_module(f"benchmarks.{name}").measure)
else:
    for benchmark in (speed, scaling, start_up, batches):
        print(f"# {benchmark.__name__.split('.')[-1]}\n\n{benchmark.measure(quick=True)}")
    print(machine())
