"""Coefficients of the methods against the order conditions of rooted trees (Butcher), Gauss nodes against moments."""

import itertools
import math
from functools import cache

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.integrate.method import METHODS, tableau
from scissordyn.integrate.tableau import EXPLICIT, primitives
from scissordyn.interpolation import gauss_rule

Tree = tuple  # of trees: the branches above its root

ORDERS = {"dop853": (8, 7), "dopri5": (5, 4), "rodas5p": (5, 4), "rodas4p": (4, 3)}  # Order of the step and of the dense output


@cache
def trees(order):
    """Return the rooted trees with `order` nodes."""
    if order == 1:
        return [()]
    found = set()
    for sizes in itertools.combinations_with_replacement(range(1, order), 1):
        largest = sizes[0]
        for branch in trees(largest):
            for rest in trees(order - largest):
                found.add(tuple(sorted((branch, *rest), key=repr)))
    return sorted(found, key=repr)


def nodes_of(tree):
    """Return the number of nodes of a tree."""
    return 1 + sum(nodes_of(branch) for branch in tree)


def density(tree):
    """Return the density of a tree: the product of the sizes of all its subtrees."""
    return nodes_of(tree) * math.prod(density(branch) for branch in tree)


def matrices(name):
    """Return the stage coefficients for nodes where several branches meet, and for nodes with a single branch.

    A Rosenbrock method is written in stages U = Gamma K, with which only systems with h gamma have to be solved: A and C are
    a = alpha Gamma^-1 and C = 1/gamma - Gamma^-1; along a single branch the Jacobian is exact, and alpha + Gamma counts.
    Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.7.
    """
    method = tableau(name)
    if method.kind == EXPLICIT:
        return method.a, method.a
    gamma = np.linalg.inv(np.diag(np.full(method.stages, 1.0 / method.gamma)) - method.c)
    alpha = method.a @ gamma
    return alpha, alpha + gamma


def weights(name, theta):
    """Return the weights of the stages K in the state at the fraction theta of the step, by the nested dense output."""
    method = tableau(name)
    size = method.nodes.size
    factors = [theta if part == 0 else 1.0 - theta for part in method.pattern]
    if method.kind == EXPLICIT:
        end = np.zeros(size)
        end[: method.stages] = method.a[method.stages, : method.stages]
        first, last = np.eye(size)[0], np.eye(size)[method.stages]
        rows = [end, first - end, 2.0 * end - first - last, *method.dense]
    else:
        # the last stage of the step is its own error estimate
        end = np.concatenate([method.a[-1, : size - 1], [1.0]])
        rows = [end, *method.dense]
    value = np.zeros(size)
    for factor, row in zip(reversed(factors), reversed(rows), strict=True):
        value = factor * (row + value)
    if method.kind == EXPLICIT:
        return value
    return value @ np.linalg.inv(np.diag(np.full(method.stages, 1.0 / method.gamma)) - method.c)


def stage_values(tree, alpha, beta):
    """Return the contribution of each stage to the elementary differential of a tree."""
    values = np.ones(len(alpha))
    matrix = beta if len(tree) == 1 else alpha
    for branch in tree:
        values = values * (matrix @ stage_values(branch, alpha, beta))
    return values


def condition(name, weight, tree):
    """Return the left side of the order condition of a tree."""
    return float(weight @ stage_values(tree, *matrices(name)))


def test_trees_are_all_there():
    """Published number: 1, 1, 2, 4, 9, 20, 48, 115 rooted trees of order 1 to 8 (OEIS A000081)."""
    assert [len(trees(order)) for order in range(1, 9)] == [1, 1, 2, 4, 9, 20, 48, 115]


def test_order_conditions_of_the_step(name):
    """Identity: every rooted tree up to the method's order has its weight, to round-off of the tabulated figures."""
    for order in range(1, ORDERS[name][0] + 1):
        for tree in trees(order):
            assert condition(name, weights(name, 1.0), tree) == pytest.approx(1.0 / density(tree), abs=3e-13), tree


def test_the_order_is_no_higher(name):
    """Contract: some tree of the next order has another weight, so that the conditions above say something."""
    above = trees(ORDERS[name][0] + 1)
    assert max(abs(condition(name, weights(name, 1.0), tree) - 1.0 / density(tree)) for tree in above) > 1e-7


@pytest.mark.parametrize("theta", [0.13, 0.5, 0.81])
def test_order_conditions_inside_the_step(name, theta):
    """Contract: the same for the dense output, with theta to the power of the tree's nodes."""
    weight = weights(name, theta)
    for order in range(1, ORDERS[name][1] + 1):
        for tree in trees(order):
            exact = theta**order / density(tree)
            assert condition(name, weight, tree) == pytest.approx(exact, abs=2e-12), tree


def test_stages_are_consistent(name):
    """Identity: the instant of each stage is the sum of its coefficients; so are the Rosenbrock methods' time derivatives."""
    method = tableau(name)
    alpha, beta = matrices(name)
    assert np.sum(alpha, axis=1) == pytest.approx(method.nodes, abs=3e-14)
    if method.kind != EXPLICIT:
        assert np.sum(beta - alpha, axis=1) == pytest.approx(method.slopes, abs=2e-14)
        assert np.diag(beta) == pytest.approx(method.gamma, abs=1e-14)


@pytest.mark.parametrize(
    ("name", "which", "blind"), [("dop853", 0, 5), ("dop853", 1, 3), ("dopri5", 0, 4), ("rodas5p", 0, 4), ("rodas4p", 0, 3)]
)
def test_error_estimates(name, which, blind):
    """Contract: an estimate vanishes on every tree up to its order, and not on all of the next."""
    method = tableau(name)
    weight = method.error[which]
    if method.kind != EXPLICIT:
        weight = weight @ np.linalg.inv(np.diag(np.full(method.stages, 1.0 / method.gamma)) - method.c)
    for order in range(1, blind + 1):
        for tree in trees(order):
            assert condition(name, weight, tree) == pytest.approx(0.0, abs=3e-14), tree
    assert max(abs(condition(name, weight, tree)) for tree in trees(blind + 1)) > 1e-5


@pytest.mark.parametrize("name", ["rodas5p", "rodas4p"])
def test_stiff_end(name):
    """Limit: on y' = z y with z towards -infinity the step ends at zero (L-stability), as does its error estimate."""
    method = tableau(name)
    for z in (-1e4, -1e6):
        left = (1.0 / method.gamma - z) * np.eye(method.stages) - method.c - z * method.a
        K = np.linalg.solve(left, np.full(method.stages, z))
        end = 1.0 + np.concatenate([method.a[-1, :-1], [1.0]]) @ K
        assert abs(end) < 30.0 / abs(z)
        assert abs(method.error[0] @ K) < 30.0 / abs(z)


def test_followed_stages(name):
    """Contract: powers are evaluated at every stage that the step or its dense output weighs, and at its end."""
    method = tableau(name)
    if method.kind != EXPLICIT:
        assert not np.any(method.followed)
        return
    weighed = np.any([weights(name, theta) != 0.0 for theta in (0.2, 0.7, 1.0)], axis=0)
    assert set(np.flatnonzero(weighed)) <= set(np.flatnonzero(method.followed))
    assert method.followed[method.stages] == 1


def test_unknown_method():
    with pytest.raises(sd.InputError, match=r"method 'dopri'.*dopri5"):
        tableau("dopri")


@pytest.mark.parametrize("points", range(2, 7))
def test_whole_step(points):
    """Closed form: the integral of theta^k over the step is 1/(k+1) up to degree 2 points - 1, and no longer beyond."""
    nodes, weights = gauss_rule(points)
    assert primitives(nodes).sum(axis=1) == pytest.approx(weights, abs=1e-13)
    for degree in range(2 * points):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), abs=1e-13)
    assert abs(weights @ nodes ** (2 * points) - 1.0 / (2 * points + 1)) > 1e-8


@pytest.mark.parametrize("points", range(2, 7))
def test_part_of_a_step(points):
    """Closed form: up to theta the integral of a polynomial through the nodes is exact up to degree points - 1."""
    nodes = gauss_rule(points)[0]
    table = primitives(nodes)
    assert np.all((nodes > 0.0) & (nodes < 1.0))
    for theta in (0.0, 0.3, 1.0):
        powers = theta ** np.arange(1, points + 1)
        for degree in range(points):
            found = (table @ powers) @ nodes**degree
            assert found == pytest.approx(theta ** (degree + 1) / (degree + 1), abs=1e-13)


@pytest.mark.parametrize("name", METHODS[2:])
def test_rule_of_a_method(name):
    """Closed form: the moments that a rule of one node more than the dense output has rows integrates exactly."""
    method = tableau(name)
    degree = 2 * method.dense.shape[0] + 1
    assert method.weight @ method.gauss**degree == pytest.approx(1.0 / (degree + 1), abs=1e-13)
    assert np.sum(method.weight) == pytest.approx(1.0, abs=1e-14)
