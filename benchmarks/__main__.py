"""Run all benchmarks, quickly."""

from __future__ import annotations

from benchmarks import batches, checkpoints, components, scaling, speed, start_up, work_precision
from benchmarks.measure import machine

for benchmark in (speed, scaling, work_precision, start_up, batches, components, checkpoints):
    print(f"# {benchmark.__name__.split('.')[-1]}\n\n{benchmark.measure(quick=True)}")
print(machine())
