"""Dormand and Prince's method of order 5 with Shampine's dense output of order 4.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, table II.5.2 and section II.6.
"""

from __future__ import annotations

from scissordyn.integrate.tableau import explicit_tableau

_A = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
_C = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
_E = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
_D = (
    (
        -12715105075 / 11282082432,
        0.0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ),
)

TABLEAU = explicit_tableau(order=5.0, stages=6, rows=_A, nodes=_C, error=(_E,), dense=_D)
