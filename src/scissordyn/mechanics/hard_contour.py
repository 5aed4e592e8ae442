"""Hard contact of a journal on worn contours: smooth gap, its direction, and the curvature of the path of the journal's centre.

A round journal touches a contour with the support function S(theta) = c + h(theta) where w = e . n(theta) - S is largest. The
gap, its derivatives and the radius of curvature rho of the path of the journal's centre on the surface are there

    delta = w,    d delta/de = n,    d delta/dpsi = g,    dn/de = t t^T / rho,    rho = e . n + S''

A journal that rests in a worn pocket touches it at many angles: rho is zero and n undetermined. The contour is therefore
opened: a disk of radius r that stays inside the path of the centre covers all places that the centre may take. This rounds the
corners of the path to the radius r, and removes bumps. The opened depths are the coefficients of a cubic B-spline: it keeps rho
positive, and the rate of n is continuous.
"""

from __future__ import annotations

import math

from scissordyn.kernel import F1, F2, entry, kernel
from scissordyn.mechanics.contour import COS, DEPTH, SIN, add_contours, deepest, wrapped
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.worn_contact import body_direction, relative_turn
from scissordyn.tolerance import EVENT_TOL, NEWTON_STEPS_MAX

CORNER_FRACTION = 0.01
"""Radius r of the corners on the path of the journal's centre in a worn bearing, relative to the clearance.

It reduces the depth of a pocket by this fraction.
"""


@kernel
def open_contour(contour, slope, clearance, kept):
    """Open a contour by a disk of `CORNER_FRACTION` clearances, and its slope by the journal's angle with it.

    Half planes e . n <= c + h - r that no other two imply remain; the others are replaced by their vertex, seen at their angle.
    An empty `slope` is left alone. `kept` has the length of the contour.
    """
    count, level, first, size = contour.shape[0], (1.0 - CORNER_FRACTION) * clearance, 0, 1
    for k in range(count):
        if contour[k, DEPTH] < contour[first, DEPTH]:
            first = k
    kept[0] = float(first)
    for k in range(first + 1, first + count + 1):
        while size > 1 and is_implied(contour, level, int(kept[size - 2]), int(kept[size - 1]), k):
            size -= 1
        if k < first + count:
            kept[size] = float(k)
            size += 1
    for i in range(size):
        a, b = int(kept[i]), int(kept[i + 1]) if i + 1 < size else first + count
        before, after = wrapped(a, count), wrapped(b, count)
        for k in range(a + 1, b):
            at = wrapped(k, count)
            left, right = contour[b - k, SIN] / contour[b - a, SIN], contour[k - a, SIN] / contour[b - a, SIN]
            contour[at, DEPTH] = left * (level + contour[before, DEPTH]) + right * (level + contour[after, DEPTH]) - level
            if slope.size > 0:
                slope[at] = left * slope[before] + right * slope[after]


@kernel
def is_implied(contour, level, a, b, k):
    """Return whether the half planes of angles a and k imply that of an angle b between them."""
    count = contour.shape[0]
    if 2 * (k - a) >= count:
        return False
    low, middle, high = (
        level + contour[wrapped(a, count), DEPTH],
        level + contour[wrapped(b, count), DEPTH],
        level + contour[wrapped(k, count), DEPTH],
    )
    return middle * contour[k - a, SIN] > low * contour[k - b, SIN] + high * contour[b - a, SIN]


@kernel
def spline_at(contour, slope, at, turn):
    """Return depth, slope and curvature of a contour by angle, and the slope by the journal's angle with its derivative.

    The angle is `turn` cells, from -2 to 2, beyond that of index `at`. Depths are coefficients of a cubic B-spline.
    """
    count = contour.shape[0]
    base = int(turn + 3.0) - 3
    s, scale = turn - base, count / (2.0 * math.pi)
    r = 1.0 - s
    k0, k1 = wrapped(at + base - 1, count), wrapped(at + base, count)
    k2, k3 = wrapped(at + base + 1, count), wrapped(at + base + 2, count)
    w0, w3 = r * r * r / 6.0, s * s * s / 6.0
    w1, w2 = 2.0 / 3.0 - s * s + 0.5 * s * s * s, 2.0 / 3.0 - r * r + 0.5 * r * r * r
    d0, d1, d2, d3 = -0.5 * r * r, 1.5 * s * s - 2.0 * s, 2.0 * r - 1.5 * r * r, 0.5 * s * s
    h0, h1, h2, h3 = contour[k0, DEPTH], contour[k1, DEPTH], contour[k2, DEPTH], contour[k3, DEPTH]
    depth = w0 * h0 + w1 * h1 + w2 * h2 + w3 * h3
    rise = scale * (d0 * h0 + d1 * h1 + d2 * h2 + d3 * h3)
    bend = scale * scale * (r * h0 + (3.0 * s - 2.0) * h1 + (3.0 * r - 2.0) * h2 + s * h3)
    lever = twist = 0.0
    if slope.size > 0:
        lever = w0 * slope[k0] + w1 * slope[k1] + w2 * slope[k2] + w3 * slope[k3]
        twist = scale * (d0 * slope[k0] + d1 * slope[k1] + d2 * slope[k2] + d3 * slope[k3])
    return depth, rise, bend, lever, twist


@kernel
def direction_at(contour, at, turn):
    """Return the unit vector at an angle that is `turn` cells beyond that of index `at`."""
    angle = turn * 2.0 * math.pi / contour.shape[0]
    cos, sin = math.cos(angle), math.sin(angle)
    return contour[at, COS] * cos - contour[at, SIN] * sin, contour[at, SIN] * cos + contour[at, COS] * sin


@kernel
def touch_contour(x, y, contour, slope, clearance):
    """Return the largest indentation [m] of a journal at (x, y), its direction, rho [m], and the lever g with dg/dtheta [m]."""
    _, at = deepest(x, y, contour, clearance)
    cell, low, high, turn = 2.0 * math.pi / contour.shape[0], -2.0, 2.0, 0.0
    for _ in range(NEWTON_STEPS_MAX):
        cos, sin = direction_at(contour, at, turn)
        depth, rise, bend, _, _ = spline_at(contour, slope, at, turn)
        climb, radius = y * cos - x * sin - rise, x * cos + y * sin + bend
        if climb > 0.0:
            low = turn
        else:
            high = turn
        new = turn + climb / (radius * cell) if radius > 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        done = abs(new - turn) <= EVENT_TOL
        turn = new
        if done:
            break
    cos, sin = direction_at(contour, at, turn)
    depth, rise, bend, lever, twist = spline_at(contour, slope, at, turn)
    along = x * cos + y * sin
    return along - clearance - depth, cos, sin, along + bend, lever, twist


@kernel
def touch_surface(j, S, maps):
    """Return the results of `touch_contour` for hard contact j; the direction is that in the frame of the bearing's body."""
    ex, ey, ax, ay, bx, by, _, _, _, _, _, _ = maps
    p, W = S.parameters.contact[j], S.work
    cos, sin = body_direction(bx, by)
    x, y = ex * cos + ey * sin, ey * cos - ex * sin
    if p.journal == 0:
        return touch_contour(x, y, S.parameters.contour[j], W.shares[0:0], p.clearance)
    turned_cos, turned_sin = relative_turn(ax, ay, bx, by)
    add_contours(
        S.parameters.contour[j], S.parameters.journal[j], math.atan2(turned_sin, turned_cos), W.surface[j], W.slopes[j]
    )
    open_contour(W.surface[j], W.slopes[j], p.clearance, W.shares)
    return touch_contour(x, y, W.surface[j], W.slopes[j], p.clearance)


@kernel
def worn_hard_gap(j, S, maps):
    """Return the indentation of hard contact j, negative in free flight, and its rate."""
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    depth, ux, uy, _, lever, _ = touch_surface(j, S, maps)
    cos, sin = body_direction(bx, by)
    nx, ny, spin = ux * cos - uy * sin, ux * sin + uy * cos, bx * qy - by * qx
    return depth, (vx + spin * ey) * nx + (vy - spin * ex) * ny + lever * (ax * py - ay * px - spin)


@kernel
def worn_hard_kinematics(j, S, maps):
    """Write delta, delta', slip speed, n, e, rho, and the lever of hard contact j into Work.contact."""
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    contact = S.work.contact[j]
    depth, ux, uy, radius, lever, twist = touch_surface(j, S, maps)
    cos, sin = body_direction(bx, by)
    nx, ny, spin = ux * cos - uy * sin, ux * sin + uy * cos, bx * qy - by * qx
    turning, x, y = ax * py - ay * px - spin, vx + spin * ey, vy - spin * ex
    contact.depth, contact.elastic, contact.lever, contact.twist, contact.bend = depth, 0.0, lever, twist, radius
    contact.rate = x * nx + y * ny + lever * turning
    contact.slip = y * nx - x * ny + S.parameters.contact[j].radius * turning
    contact.nx, contact.ny = nx, ny
    contact.distance, contact.aside = ex * nx + ey * ny, ey * nx - ex * ny


@kernel
def worn_turning(j, S):
    """Return the speed u_t of the journal across n relative to the bearing, and the speed rho (theta' + w_B) at which n turns.

    Work.contact contains the normal of hard contact j.
    """
    ex, ey, ax, ay, bx, by, vx, vy, px, py, qx, qy = map_values(j, S)
    contact = S.work.contact[j]
    nx, ny, spin = contact.nx, contact.ny, bx * qy - by * qx
    across = (vy - spin * ex) * nx - (vx + spin * ey) * ny
    return across, across + contact.twist * (ax * py - ay * px - spin) + spin * contact.bend


@kernel
def worn_convective(j, S):
    """Return the second derivative of the indentation of hard contact j at zero acceleration [m/s^2].

    2 w_B u_t + w_B^2 e . n + (u_t + g' psi')^2 / rho - g' psi'^2, as g depends on theta - psi
    """
    ex, ey, ax, ay, bx, by, _, _, px, py, qx, qy = map_values(j, S)
    contact = S.work.contact[j]
    across, turned = worn_turning(j, S)
    spin = bx * qy - by * qx
    turning, moved = ax * py - ay * px - spin, turned - spin * contact.bend
    inner = spin * (2.0 * across + spin * (ex * contact.nx + ey * contact.ny)) - contact.twist * turning * turning
    return inner + moved * moved / contact.bend if contact.bend > 0.0 else inner


@entry
def opened_contour(contour: F2, slope: F1, clearance: float, kept: F1) -> None:
    """Open a contour in place for hard contact, see `open_contour`."""
    open_contour(contour, slope, clearance, kept)


@entry
def touch_at(x: float, y: float, contour: F2, slope: F1, clearance: float, out: F1) -> None:
    """Write largest indentation [m], its direction, rho [m], lever [m] and its derivative by angle [m] to `out`."""
    out[0], out[1], out[2], out[3], out[4], out[5] = touch_contour(x, y, contour, slope, clearance)


@entry
def place_on(nx: float, ny: float, contour: F2, clearance: float, out: F1) -> None:
    """Write the position [m] of a journal that touches an opened contour in the direction of a unit vector to `out`."""
    cell = 2.0 * math.pi / contour.shape[0]
    angle = math.atan2(ny, nx) / cell
    at = int(angle + contour.shape[0]) % contour.shape[0]
    depth, rise, _, _, _ = spline_at(contour, out[0:0], at, angle + contour.shape[0] - int(angle + contour.shape[0]))
    out[0], out[1] = (clearance + depth) * nx - rise * ny, (clearance + depth) * ny + rise * nx
