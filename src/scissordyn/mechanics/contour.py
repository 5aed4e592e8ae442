"""Journal in a worn bearing: indentation, pressure, force and energy over the angle, and the wear of both by given loads.

The contour h(theta) is the depth by which the bearing is worn, at equally spaced angles in the frame of its body, and linear
in between. At the eccentricity e the journal indents the bearing at each angle by

    w(theta) = e_x cos(theta) + e_y sin(theta) - c - h(theta)

With the pressure p(w) of `laws.foundation`, linear w between two angles and A the area of a cell, force and energy are

    f = sum A int p(w) (cos, sin) ds,    U = sum A int P(w) ds,    P' = p,    f = dU/de

All integrals are closed forms of p, P and Q with Q' = P, also in a cell in which the contact ends. A worn journal has a contour
too, in the frame of its own body. Its depths are added to those of the bearing that they face.
"""

from __future__ import annotations

import math

from scissordyn.kernel import F1, F2, F3, entry, kernel
from scissordyn.laws.foundation import EXPONENT, FIRST, INDENTATION, PRESSURE, SECOND, STEP
from scissordyn.tolerance import EVENT_TOL, NEWTON_STEPS_MAX

DEPTH, COS, SIN = range(3)  # columns of a contour

FLAT_FRACTION = 1e-3
"""Largest relative difference of the indentations at both ends of a contour cell for which Simpson's rule is used.

Its error is 1e-13 there. The closed form loses the square of this fraction by cancellation.
"""


SUBSTEP_FRACTION = 0.25
"""Largest change of a contour in a substep of wear, as a fraction of the elastic indentation of the same load.

Euler's method is stable below 2 for a pressure proportional to the indentation.
"""


@kernel
def pressure(w, table):
    """Return the pressure p at an indentation w > 0, and its integrals P and Q."""
    logarithm = math.log(w / table[0, INDENTATION])
    k = max(0, min(int(logarithm / table[0, STEP]), table.shape[0] - 1))
    start, m, first = table[k, INDENTATION], table[k, EXPONENT], table[k, PRESSURE]
    p = first * math.exp(m * (logarithm - k * table[0, STEP]))
    part = (p * w - first * start) / (m + 1.0)
    low = table[k, FIRST] - first * start / (m + 1.0)
    double = (p * w * w - first * start * start) / ((m + 1.0) * (m + 2.0))
    return p, table[k, FIRST] + part, table[k, SECOND] + low * (w - start) + double


@kernel
def cell_count(angle, count):
    """Return the number of cells that an angle from 0 to pi spans, rounded up, at most half of all."""
    return min(int(angle * count / (2.0 * math.pi)) + 1, count // 2)


@kernel
def nearest_cell(ex, ey, count):
    """Return the index of the angle of the contour nearest to a direction; 0 for NaN, which a rejected step may contain."""
    angle = math.atan2(ey, ex) * count / (2.0 * math.pi)
    if math.isnan(angle):
        return 0
    k = int(angle + count + 0.5)
    return k - count if k >= count else k


@kernel
def wrapped(k, count):
    """Return the index between 0 and count - 1 for the same angle as k, which is at most one turn outside."""
    if k < 0:
        return k + count
    return k - count if k >= count else k


@kernel
def add_contours(bearing, journal, angle, surface, slope):
    """Write the sum of the contours of a bearing and of a journal that has turned by an angle, and its slope [m/rad].

    The depths of the journal are interpolated by a quadratic B-spline, whose slope is continuous and whose mean is theirs.
    """
    count = bearing.shape[0]
    near = nearest_cell(math.cos(angle), math.sin(angle), count)
    s = near - angle * count / (2.0 * math.pi)
    if s > 0.5 * count:
        s -= count
    low, middle, high = 0.5 * (0.5 - s) * (0.5 - s), 0.75 - s * s, 0.5 * (0.5 + s) * (0.5 + s)
    for k in range(count):
        at = wrapped(k - near, count)
        before, here, after = journal[wrapped(at - 1, count)], journal[at], journal[wrapped(at + 1, count)]
        surface[k, DEPTH] = bearing[k, DEPTH] + low * before + middle * here + high * after
        surface[k, COS], surface[k, SIN] = bearing[k, COS], bearing[k, SIN]
        slope[k] = ((0.5 + s) * after - 2.0 * s * here - (0.5 - s) * before) * count / (2.0 * math.pi)


@kernel
def deepest(ex, ey, contour, clearance):
    """Return the largest indentation [m] of a journal at (ex, ey) over all angles, and the index of its angle.

    Without contact it is negative: minus the smallest gap.
    """
    count, e = contour.shape[0], math.sqrt(ex * ex + ey * ey)
    middle = nearest_cell(ex, ey, count)
    best, at = ex * contour[middle, COS] + ey * contour[middle, SIN] - clearance - contour[middle, DEPTH], middle
    # h >= 0, so that beyond this angle w is smaller than at the middle
    level = (best + clearance) / e if e > 0.0 else -1.0
    reach = cell_count(math.acos(max(-1.0, min(1.0, level))), count)
    for step in range(-reach, reach + 1):
        k = wrapped(middle + step, count)
        w = ex * contour[k, COS] + ey * contour[k, SIN] - clearance - contour[k, DEPTH]
        if w > best:
            best, at = w, k
    return best, at


@kernel
def crest(ex, ey, contour, at):
    """Return the direction of the largest indentation, by the parabola through it and its neighbours."""
    count = contour.shape[0]
    before, after = wrapped(at - 1, count), wrapped(at + 1, count)
    left = ex * contour[before, COS] + ey * contour[before, SIN] - contour[before, DEPTH]
    middle = ex * contour[at, COS] + ey * contour[at, SIN] - contour[at, DEPTH]
    right = ex * contour[after, COS] + ey * contour[after, SIN] - contour[after, DEPTH]
    bend = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    turn = max(-0.5, min(0.5, shift)) * 2.0 * math.pi / count
    cos, sin = math.cos(turn), math.sin(turn)
    return contour[at, COS] * cos - contour[at, SIN] * sin, contour[at, SIN] * cos + contour[at, COS] * sin


@kernel
def press(ex, ey, contour, table, clearance, area, shares):
    """Return the force of the journal on the bearing [N] and its energy [J]; add the pressure force of each angle to `shares`.

    `area` is that of a cell. An empty `shares` receives nothing.
    """
    fx = fy = energy = 0.0
    count, e = contour.shape[0], math.sqrt(ex * ex + ey * ey)
    if not e > clearance:
        return fx, fy, energy
    middle, reach = nearest_cell(ex, ey, count), cell_count(math.acos(clearance / e), count)
    before, w0, p0, first0, second0 = 0, -1.0, 0.0, 0.0, 0.0
    for step in range(-reach - 1, reach + 2):
        k = wrapped(middle + step, count)
        w1 = ex * contour[k, COS] + ey * contour[k, SIN] - clearance - contour[k, DEPTH]
        p1 = first1 = second1 = 0.0
        if w1 > 0.0:
            p1, first1, second1 = pressure(w1, table)
        if step > -reach - 1 and (w0 > 0.0 or w1 > 0.0):
            d = w1 - w0
            if w0 > 0.0 and w1 > 0.0 and abs(d) < FLAT_FRACTION * 0.5 * (w0 + w1):
                pm, firstm, _ = pressure(0.5 * (w0 + w1), table)
                share0, share1 = area * (p0 + 2.0 * pm) / 6.0, area * (p1 + 2.0 * pm) / 6.0
                energy += area * (first0 + 4.0 * firstm + first1) / 6.0
            else:
                share1 = area * (d * first1 - (second1 - second0)) / (d * d)
                share0 = area * (first1 - first0) / d - share1
                energy += area * (second1 - second0) / d
            fx += share0 * contour[before, COS] + share1 * contour[k, COS]
            fy += share0 * contour[before, SIN] + share1 * contour[k, SIN]
            if shares.size > 0:
                shares[before] += share0
                shares[k] += share1
        before, w0, p0, first0, second0 = k, w1, p1, first1, second1
    return fx, fy, energy


@kernel
def bracket_place(nx, ny, force, contour, table, clearance, area, shares):
    """Return the eccentricity [m] along the direction (nx, ny) at which the force along it is `force` [N], by bisection."""
    low, high = clearance, 1.001 * clearance
    for _ in range(NEWTON_STEPS_MAX):
        fx, fy, _ = press(high * nx, high * ny, contour, table, clearance, area, shares)
        if fx * nx + fy * ny >= force:
            break
        low, high = high, clearance + 2.0 * (high - clearance)
    for _ in range(NEWTON_STEPS_MAX):
        middle = 0.5 * (low + high)
        fx, fy, _ = press(middle * nx, middle * ny, contour, table, clearance, area, shares)
        if fx * nx + fy * ny < force:
            low = middle
        else:
            high = middle
    return high


@kernel
def improve_place(ex, ey, px, py, contour, table, clearance, area, shares):
    """Improve the eccentricity (ex, ey) of a journal under the load (px, py); return it and the residual force.

    Newton's method with the tangent by differences; a step that leaves the contact, or does not reduce the residual, is halved.
    """
    size = math.sqrt(px * px + py * py)
    fx, fy, _ = press(ex, ey, contour, table, clearance, area, shares)
    residual = math.hypot(px - fx, py - fy)
    for _ in range(NEWTON_STEPS_MAX):
        if residual <= EVENT_TOL * size:
            break
        depth, _ = deepest(ex, ey, contour, clearance)
        h = 1e-4 * max(depth, 1e-9 * clearance)
        ax, ay, _ = press(ex + h, ey, contour, table, clearance, area, shares)
        bx, by, _ = press(ex, ey + h, contour, table, clearance, area, shares)
        xx, xy, yx, yy = (ax - fx) / h, (bx - fx) / h, (ay - fy) / h, (by - fy) / h
        determinant = xx * yy - xy * yx
        if not determinant > 0.0:
            break
        dx = (yy * (px - fx) - xy * (py - fy)) / determinant
        dy = (xx * (py - fy) - yx * (px - fx)) / determinant
        fraction, is_reduced = 1.0, False
        for _ in range(NEWTON_STEPS_MAX):
            gx, gy, _ = press(ex + fraction * dx, ey + fraction * dy, contour, table, clearance, area, shares)
            new = math.hypot(px - gx, py - gy)
            if new < residual and (gx != 0.0 or gy != 0.0):
                ex, ey, fx, fy, residual, is_reduced = ex + fraction * dx, ey + fraction * dy, gx, gy, new, True
                break
            fraction *= 0.5
        if not is_reduced:
            break
    return ex, ey, residual


@entry
def turned_contours(bearing: F2, journal: F1, angle: float, surface: F2, slope: F1) -> None:
    """Write the sum of the contours of a bearing and of a journal that has turned by an angle [rad], and its slope [m/rad]."""
    add_contours(bearing, journal, angle, surface, slope)


@entry
def press_at(ex: float, ey: float, contour: F2, table: F2, clearance: float, area: float, shares: F1, out: F1) -> None:
    """Write the force of the journal on the bearing, its energy, and the largest indentation to `out`."""
    out[0], out[1], out[2] = press(ex, ey, contour, table, clearance, area, shares)
    out[3], _ = deepest(ex, ey, contour, clearance)


@entry
def place_under(px: float, py: float, contour: F2, table: F2, clearance: float, area: float, out: F1) -> None:
    """Write the eccentricity at which the journal presses on the bearing with a force to `out`, and the residual force."""
    force = math.hypot(px, py)
    e = bracket_place(px / force, py / force, force, contour, table, clearance, area, out[3:3])
    out[0], out[1], out[2] = improve_place(e * px / force, e * py / force, px, py, contour, table, clearance, area, out[3:3])


@kernel
def add_counter(surface, counter, turn, spread, sums, out):
    """Write a contour plus the mean of the other surface's depths over the angles from turn - spread to turn + spread.

    The other surface has turned by these angles. `sums` receives the sums of its depths before each angle.
    """
    count, total = surface.shape[0], 0.0
    for k in range(count):
        sums[k] = total
        total += counter[k, DEPTH]
    half = max(0.5, spread * count / (2.0 * math.pi))  # half a cell interpolates linearly
    for k in range(count):
        place = k - turn * count / (2.0 * math.pi) + 2.0 * count + 0.5
        mean = sum_before(counter, sums, total, place + half) - sum_before(counter, sums, total, place - half)
        out[k, DEPTH], out[k, COS], out[k, SIN] = surface[k, DEPTH] + 0.5 * mean / half, surface[k, COS], surface[k, SIN]


@kernel
def sum_before(contour, sums, total, place):
    """Return the sum of the depths of a periodic contour from angle 0 to a place > 0, counted in cells."""
    k = int(place)
    turns = k // contour.shape[0]
    at = k - turns * contour.shape[0]
    return turns * total + sums[at] + (place - k) * contour[at, DEPTH]


@kernel
def add_rate(contour, table, clearance, area, b, loads, force, place, scale, own_area, shares, rate, stiff):
    """Add the depth that load b wears on a contour to `rate`, and its ratio to the elastic indentation to `stiff`, by angle."""
    nx, ny = math.cos(2.0 * math.pi * b / loads), math.sin(2.0 * math.pi * b / loads)
    px, py = force * nx, force * ny
    rest = force
    if not math.isnan(place[0]):
        place[0], place[1], rest = improve_place(place[0], place[1], px, py, contour, table, clearance, area, shares[0:0])
    if not rest < (1.0 - EVENT_TOL) * force:  # at first, or after stronger loads have worn the contour away from this one
        e = bracket_place(nx, ny, force, contour, table, clearance, area, shares[0:0])
        place[0], place[1], _ = improve_place(e * nx, e * ny, px, py, contour, table, clearance, area, shares[0:0])
    shares[:] = 0.0
    press(place[0], place[1], contour, table, clearance, area, shares)
    depth, _ = deepest(place[0], place[1], contour, clearance)
    total = 0.0
    for i in range(shares.size):
        total += shares[i]
    for i in range(shares.size):
        depth_rate = scale * shares[i] / (total * own_area)
        rate[i] += depth_rate
        stiff[i] += depth_rate / depth


@entry
def wear_out(
    contours: F3,
    table: F2,
    clearance: float,
    area: float,
    areas: F1,
    energy: F2,
    force: F2,
    turn: F2,
    spread: F2,
    place: F3,
    coefficients: F1,
    substeps: int,
    work: F2,
    pressed: F2,
) -> float:
    r"""Wear the contour of a bearing, or those of bearing and journal, and return the completed fraction of the wear.

    Load b of a surface acts at the angle 2 pi b / loads of its body with a force [N] and the friction energy divided by the
    friction coefficient [J]: the integral of F |v| dt. Archard's law distributes the volume k int F |v| dt as the pressure is
    distributed,

    .. math:: \mathrm{d}h_i = \frac{k}{A} \sum_b \frac{p_{ib}}{\sum_i p_{ib}}\, \mathrm{d}E_b

    Each surface is pressed against the mean contour of the other one, over the rotations from turn - spread to turn + spread
    [rad] of the journal at which load b acts. The places of the journal under each load follow the contours. `place` holds
    them, NaN at first. `area` is that of a cell in the contact, `areas` that of a worn cell of each surface. `work` has six
    rows of the contour's length; `pressed` has the shape of a contour.
    """
    loads, done, surfaces = energy.shape[1], 0.0, contours.shape[0]
    for _ in range(substeps):
        largest = 0.0
        for s in range(surfaces):
            rate, stiff = work[2 + 2 * s], work[3 + 2 * s]
            rate[:], stiff[:] = 0.0, 0.0
            for k in range(rate.size):
                pressed[k, DEPTH], pressed[k, COS], pressed[k, SIN] = (
                    contours[s, k, DEPTH],
                    contours[s, k, COS],
                    contours[s, k, SIN],
                )
            for b in range(loads):
                if not (energy[s, b] > 0.0 and coefficients[s] > 0.0):
                    continue
                if surfaces > 1:  # the journal turns by psi relative to the bearing, and the bearing by -psi relative to it
                    add_counter(contours[s], contours[1 - s], (1 - 2 * s) * turn[s, b], spread[s, b], work[1], pressed)
                scale = coefficients[s] * energy[s, b]
                add_rate(
                    pressed, table, clearance, area, b, loads, force[s, b], place[s, b], scale, areas[s], work[0], rate, stiff
                )
            most = 0.0
            for i in range(stiff.size):
                most = max(most, stiff[i])
            largest += most
        part = 1.0 - done
        if largest > 0.0:
            part = min(part, SUBSTEP_FRACTION / largest)
        for s in range(surfaces):
            rate = work[2 + 2 * s]
            for i in range(rate.size):
                contours[s, i, DEPTH] += part * rate[i]
        done = 1.0 if part >= 1.0 - done else done + part
        if done >= 1.0:
            break
    return done
