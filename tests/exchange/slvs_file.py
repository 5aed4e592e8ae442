"""Files of SolveSpace with one sketch."""

ORIGIN = 0x80020002  # Handle of the origin of the sketch
AXES = ((1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5), (0.5, -0.5, -0.5, -0.5))  # Quaternions of the planes xy, yz, zx

Record = tuple[str, dict[str, object]]  # Kind and fields


def end(line, side=0):
    """Return the handle of a line (side 0), of its start (1) or of its end (2); lines are numbered from 0."""
    return (line + 4 << 16) + side


def _point(handle, place, parameter):
    act = {"actPoint.x": place.real, "actPoint.y": place.imag}
    yield "Entity", {"h.v": handle, "type": 2001, "workplane.v": 0x80020000, **act}
    yield "Param", {"h.v.": parameter, "val": place.real}
    yield "Param", {"h.v.": parameter + 1, "val": place.imag}


def _references():
    """Yield the two groups of a file, and the planes and the origin that its sketch refers to."""
    yield "Group", {"h.v": 1, "type": 5000, "name": "#references", "visible": 1, "scale": 1.0}
    plane = {"activeWorkplane.v": 0x80020000, "subtype": 6000, "predef.q.w": 1.0, "predef.origin.v": 0x10001}
    yield "Group", {"h.v": 2, "type": 5001, "order": 1, "name": "sketch", **plane, "visible": 1, "scale": 1.0}
    for number, axes in enumerate(AXES, start=1):
        base = number << 16
        yield "Request", {"h.v": number, "type": 100, "group.v": 1, "construction": 0}
        yield "Entity", {"h.v": base, "type": 10000, "point[0].v": base + 1, "normal.v": base + 0x20}
        yield "Entity", {"h.v": base + 1, "type": 2000}
        turn = dict(zip(("actNormal.w", "actNormal.vx", "actNormal.vy", "actNormal.vz"), axes, strict=True))
        yield "Entity", {"h.v": base + 0x20, "type": 3000, "point[0].v": base + 1, **turn}
        for k, value in enumerate((0.0, 0.0, 0.0)):
            yield "Param", {"h.v.": base + 0x10 + k, "val": value}
        for k, value in enumerate(axes):
            yield "Param", {"h.v.": base + 0x20 + k, "val": value}
    yield "Entity", {"h.v": 0x80020000, "type": 10000, "point[0].v": ORIGIN, "normal.v": 0x80020001}
    yield "Entity", {"h.v": 0x80020001, "type": 3010, "point[0].v": ORIGIN, "actNormal.w": 1.0}
    yield "Entity", {"h.v": ORIGIN, "type": 2012}


def _drawn(lines, circles, thin):
    for k, places in enumerate(lines):
        yield "Request", {"h.v": k + 4, "type": 200, "workplane.v": 0x80020000, "group.v": 2, "construction": int(k in thin)}
        ends = {"point[0].v": end(k, 1), "point[1].v": end(k, 2)}
        yield "Entity", {"h.v": end(k), "type": 11000, **ends, "workplane.v": 0x80020000}
        for side, place in enumerate(places, start=1):
            yield from _point(end(k, side), complex(place), end(k, 3 * side + 13))
    for k, (centre, radius) in enumerate(circles, start=len(lines)):
        yield "Request", {"h.v": k + 4, "type": 400, "workplane.v": 0x80020000, "group.v": 2, "construction": 0}
        parts = {"point[0].v": end(k, 1), "normal.v": end(k, 0x20), "distance.v": end(k, 0x40)}
        yield "Entity", {"h.v": end(k), "type": 13000, **parts, "workplane.v": 0x80020000}
        yield from _point(end(k, 1), complex(centre), end(k, 0x10))
        yield "Param", {"h.v.": end(k, 0x40), "val": radius}
        yield "Entity", {"h.v": end(k, 0x40), "type": 4000, "actDistance": radius}


def slvs(lines, constraints, *, circles=(), thin=(), more=()):
    """Return the text of a file with lines and circles in the plane of x and y [mm].

    Circles are numbered after the lines. `thin` are the numbers of construction lines, `more` are further records.
    """
    records = [*_references(), *_drawn(lines, circles, thin), *more]
    for number, constraint in enumerate(constraints, start=1):
        named = {key if key in ("type", "valA", "reference") else f"{key}.v": value for key, value in constraint.items()}
        records.append(("Constraint", {"h.v": number, "group.v": 2, "workplane.v": 0x80020000, **named}))
    text = ["SolveSpaceREVa\n\n"]
    for kind in ("Group", "Param", "Request", "Entity", "Constraint"):
        for record, fields in records:
            if record == kind:
                shown = {key: f"{value:08x}" if key.endswith((".v", "v.")) else value for key, value in fields.items()}
                text.append("\n".join([*(f"{kind}.{key}={value}" for key, value in shown.items()), f"Add{kind}\n"]))
    return "\n".join(text)


def joined(*pairs):
    """Return the constraints of points that coincide."""
    return [{"type": 20, "ptA": a, "ptB": b} for a, b in pairs]


def length(line, value):
    """Return the constraint of a line's length [mm]."""
    return {"type": 30, "valA": value, "ptA": end(line, 1), "ptB": end(line, 2)}
