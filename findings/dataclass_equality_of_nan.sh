#!/usr/bin/env bash
# CPython 3.12.1 and 3.13.0, 2026-11-29: two dataclasses that hold the same NaN object are equal in 3.12 and unequal in 3.13.
#
# Until 3.12 the generated __eq__ compares tuples of the fields, and tuples take identical objects as equal. From 3.13 on it compares
# field by field, where NaN differs from itself. Results that mark missing estimates by NaN are no longer equal to their copies.
# Seen with CPython 3.12.1 and 3.13.0. Needs python3.12 and python3.13 on the path.
set -euo pipefail
program='
from dataclasses import dataclass
import math
@dataclass
class Estimate:
    mean: float
print(Estimate(math.nan) == Estimate(math.nan), Estimate(1.0) == Estimate(1.0))
'
old=$(python3.12 -c "$program")
new=$(python3.13 -c "$program")
echo "3.12: $old"
echo "3.13: $new"
[ "$old" = "True True" ] && [ "$new" = "False True" ]
