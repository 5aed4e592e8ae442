"""Coefficients of Steinebach's Rosenbrock methods.

RODAS5P has order 5 and a dense output of order 4; it is stiffly accurate and L-stable, suits index-1 problems and has little
order reduction. Steinebach 2023, "Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia
Differential Equations package", doi:10.1007/s10543-023-00967-x.

RODAS4P has order 4 for parabolic problems, and a dense output of order 3: Hairer, Wanner, Solving Ordinary Differential
Equations II, 2nd edition, section VI.4; the digits are those of RODASP.
"""

from __future__ import annotations

from scissordyn.integrate.tableau import rosenbrock_tableau

# RODAS5P: coefficients of the stages, couplings to earlier stages, nodes, time derivative, dense output
_LAST5 = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946)
_A5 = (
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    _LAST5,
    (*_LAST5, 1.0),
    (*_LAST5, 1.0, 1.0),
)
_COUPLINGS5 = (
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
    (30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623, -28.087943162872662),
    (
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        -54.66780262877968,
        -9.48861652309627,
    ),
)
_NODES5 = (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0)
# Factors of the time derivative of the right-hand side in the stages of RODAS5P
_SLOPES5 = (0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069)
_DENSE5 = (
    (
        25.948786856663858,
        -2.5579724845846235,
        10.433815404888879,
        -2.3679251022685204,
        0.524948541321073,
        1.1241088310450404,
        0.4272876194431874,
        -0.17202221070155493,
    ),
    (
        -9.91568850695171,
        -0.9689944594115154,
        3.0438037242978453,
        -24.495224566215796,
        20.176138334709044,
        15.98066361424651,
        -6.789040303419874,
        -6.710236069923372,
    ),
    (
        11.419903575922262,
        2.8879645146136994,
        72.92137995996029,
        80.12511834622643,
        -52.072871366152654,
        -59.78993625266729,
        -0.15582684282751913,
        4.883087185713722,
    ),
)

# Rosenbrock method RODAS5P of order 5, as a table of coefficients
RODAS5P = rosenbrock_tableau(
    order=5.0, gamma=0.21193756319429014, rows=_A5, couplings=_COUPLINGS5, nodes=_NODES5, slopes=_SLOPES5, dense=_DENSE5
)

# RODAS4P, in the same order
_LAST4 = (-7.170454962423024, -4.741636671481785, -16.31002631330971, -1.062004044111401)
_A4 = (
    (3.0,),
    (1.831036793486759, 0.4955183967433795),
    (2.304376582692669, -0.05249275245743001, -1.176798761832782),
    _LAST4,
    (*_LAST4, 1.0),
)
_COUPLINGS4 = (
    (-12.0,),
    (-8.791795173947035, -2.207865586973518),
    (10.81793056857153, 6.780270611428266, 19.53485944642410),
    (34.19095006749676, 15.49671153725963, 54.74760875964130, 14.16005392148534),
    (34.62605830930532, 15.30084976114473, 56.99955578662667, 18.40807009793095, -5.714285714285717),
)
_NODES4 = (0.0, 0.75, 0.21, 0.63, 1.0, 1.0)
_SLOPES4 = (0.25, -0.5, -0.023504, -0.0362)  # Factors of the time derivative of the right-hand side in the stages of RODAS4P
_DENSE4 = (
    (25.09876703708589, 11.62013104361867, 28.49148307714626, -5.664021568594133, 0.0, 0.0),
    (1.638054557396973, -0.7373619806678748, 8.477918219238990, 15.99253148779520, -1.882352941176471, 0.0),
)

# Rosenbrock method RODAS4P of order 4, as a table of coefficients
RODAS4P = rosenbrock_tableau(
    order=4.0, gamma=0.25, rows=_A4, couplings=_COUPLINGS4, nodes=_NODES4, slopes=_SLOPES4, dense=_DENSE4
)
