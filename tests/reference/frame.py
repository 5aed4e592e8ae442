"""Linear buckling of plane frames: cubic Euler-Bernoulli elements between nodes; pinned ends have separate rotations."""

import itertools

import numpy as np
import scipy.linalg as sl

Point = tuple[float, float]


class Frame:
    """Frame of straight members that share nodes; a pinned member has a separate rotation at each node."""

    def __init__(self, axial_stiffness, bending_stiffness, parts=8):
        self.axial, self.bending, self.parts = axial_stiffness, bending_stiffness, parts
        self.elements: list[tuple[np.ndarray, float, float]] = []
        self.nodes: dict[str, list[int]] = {}
        self.fixed: set[int] = set()
        self.loads: dict[int, float] = {}
        self.count = 0

    def _new(self, number):
        self.count += number
        return list(range(self.count - number, self.count))

    def member(self, places, pinned=False, weight=0.0):
        """Add a member through named nodes in a line with a weight [N/m], and return its rotations there."""
        rotations = {}
        for name, _ in places:
            node = self.nodes.setdefault(name, self._new(3))
            rotations[name] = self._new(1)[0] if pinned else node[2]
        for (one, a), (other, b) in itertools.pairwise(places):
            before = [*self.nodes[one][:2], rotations[one]]
            length = float(np.hypot(b[0] - a[0], b[1] - a[1])) / self.parts
            angle = float(np.arctan2(b[1] - a[1], b[0] - a[0]))
            for k in range(self.parts):
                last = k == self.parts - 1
                after = [*self.nodes[other][:2], rotations[other]] if last else self._new(3)
                self.elements.append((np.array(before + after), length, angle))
                across = -weight * np.cos(angle) * length**2 / 12.0
                for dof, value in ((before[1], -0.5 * weight * length), (after[1], -0.5 * weight * length)):
                    self.loads[dof] = self.loads.get(dof, 0.0) + value
                self.loads[before[2]] = self.loads.get(before[2], 0.0) + across
                self.loads[after[2]] = self.loads.get(after[2], 0.0) - across
                before = after
        return rotations

    def factors(self, count=1):
        """Return the smallest positive factors of the loads, or an empty array."""
        stiffness, geometric = np.zeros((2, self.count, self.count))
        parts = []
        for dofs, length, angle in self.elements:
            cos, sin = np.cos(angle), np.sin(angle)
            turn = np.kron(np.eye(2), np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]))
            local = np.zeros((6, 6))
            local[np.ix_([0, 3], [0, 3])] = self.axial / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
            bent = np.array([[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]])
            pulled = np.array(
                [[36.0, 3.0, -36.0, 3.0], [3.0, 4.0, -3.0, -1.0], [-36.0, -3.0, 36.0, -3.0], [3.0, -1.0, -3.0, 4.0]]
            )
            unit = np.outer(*[[1.0, length, 1.0, length]] * 2)
            local[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = self.bending / length**3 * bent * unit
            across = np.zeros((6, 6))
            across[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = pulled * unit / (30.0 * length)
            stiffness[np.ix_(dofs, dofs)] += turn.T @ local @ turn
            parts.append((dofs, length, turn, turn.T @ across @ turn))
        loose = np.flatnonzero(np.diag(stiffness) == 0.0)
        free = np.setdiff1d(np.arange(self.count), [*self.fixed, *loose])
        load = np.zeros(self.count)
        load[list(self.loads)] = list(self.loads.values())
        moved = np.zeros(self.count)
        moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
        scale = float(np.max(np.abs(load)))
        for dofs, length, turn, across in parts:
            local = turn @ moved[dofs]
            tension = self.axial / length * (local[3] - local[0])
            geometric[np.ix_(dofs, dofs)] += across * (tension if abs(tension) > 1e-8 * scale else 0.0)
        inside = np.ix_(free, free)
        inverse = sl.eigh(geometric[inside], stiffness[inside], eigvals_only=True)
        inverse = inverse[inverse < -1e-9 * np.max(np.abs(inverse))]
        return np.asarray(np.sort(-1.0 / inverse)[:count])
