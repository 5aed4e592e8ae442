"""Latches: which of their constraints are active."""

from __future__ import annotations

from scissordyn.kernel import kernel


@kernel
def engage(S):
    """Activate the constraints of latches, or not, as their modes say."""
    M, W = S.model, S.work
    for latch in range(M.latch.shape[0]):
        k, p, component = M.latch[latch, 0], M.latch[latch, 1], M.latch[latch, 2]
        locked = float(S.state.mode[M.component_guard[component]])
        W.inactive[k] = 1.0 - locked
        W.part_weight[p] = locked * M.part_full[p]
        W.part_weight[p + 1] = locked * M.part_full[p + 1]
