"""Run all benchmarks, quickly."""

from __future__ import annotations

from benchmarks import scaling, speed, start_up, studies, work_precision
from benchmarks.measure import machine

for benchmark in (speed, scaling, work_precision, start_up, studies):
    print(f"# {benchmark.__name__.split('.')[-1]}\n\n{benchmark.measure(quick=True)}")
print(machine())
