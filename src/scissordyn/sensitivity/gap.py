"""Find contacts, latches and stops that nearly begin or end within a step, so that a change of a parameter may let them."""

from __future__ import annotations

from scissordyn.integrate.event import sign_of
from scissordyn.kernel import derivative, kernel, value_of


@kernel
def watch_gaps(problem, starts, run, s, w, system):
    """Find guards that come close to zero within a step and turn back; `starts` after an event, where modes change."""
    t = s.clock[0].time
    problem.forget(system)
    problem.guards(t, s.y, system, w.value, w.rate)
    problem.forget(system)
    for guard in range(s.mode.size):
        old, sign = run.gap[guard], sign_of(s.mode[guard])
        value, rate = sign * w.value[guard], sign * w.rate[guard]
        now, before, size = value_of(t), old[2], value_of(t) - old[0]
        if not starts and before > 0.0 and rate <= 0.0:
            part = before / (before - value_of(rate))  # of the step, where the linear rate is zero
            rest = 1.0 - part
            # cubic through values and rates at both ends
            largest = old[1] * rest * rest * (1.0 + 2.0 * part) + value_of(value) * part * part * (1.0 + 2.0 * rest)
            largest += size * part * rest * (before * rest - value_of(rate) * part)
            for k in range(run.nearby.size):
                slope = rest * old[3 + k] + part * (derivative(value, k) - value_of(rate) * derivative(t, k))
                if largest <= 0.0 and largest + run.change[0] * abs(slope) > 0.0:
                    run.nearby[k] = min(run.nearby[k], old[0] + part * size)
        old[0], old[1], old[2] = now, value_of(value), value_of(rate)
        for k in range(run.nearby.size):
            old[3 + k] = derivative(value, k) - value_of(rate) * derivative(t, k)
