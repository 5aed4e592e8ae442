"""Links of PMKS+ as its public source writes them, made from joints and links; nothing of the package is used."""

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"  # Digits 0 to 63 of numbers in a PMKS+ link

PRISMATIC, INPUT, GROUNDED, WELDED = 1, 2, 4, 8  # Flags of a joint in a PMKS+ link

PLACE = tuple[float, float]  # Type of a position: x and y


def number(value):
    """Return an integer in base 64; a leading zero marks a negative one."""
    left, text = abs(value), ""
    while True:
        text = DIGITS[left % 64] + text
        left //= 64
        if not left:
            return ("0" if value < 0 else "") + text


def decimal(value):
    return number(round(1000 * value))


def joint(name, place, flags=0, angle=0.0, *further):
    return ",".join((DIGITS[flags] + name, name, decimal(place[0]), decimal(place[1]), decimal(angle), *further))


def bar(name, joints, mass, inertia, centre, kind="YR"):
    numbers = (decimal(mass), decimal(inertia), decimal(centre[0]), decimal(centre[1]))
    return ",".join((kind + name, name, *numbers, "c5cae9", *joints, "", ""))


def checked(text):
    return text + DIGITS[len(text) % 62]


def link(joints, bars, forces=(), *, speed=20, clockwise=False, units="2011", decimals="TY"):
    """Return the address of a link; lengths are in metres unless `units` has another code."""
    settings = DIGITS[0] + DIGITS[int(clockwise)]
    parts = (settings, decimals, f"{number(speed)},0", units, *joints, "", *bars, "", *forces, "", "N_")
    return "https://app.pmksplus.com/?" + checked(".".join(parts))


def linkage(places, bars, ground, first, *, slides=None, **how):
    """Return the link of a linkage: joints have one letter, bars are texts of their joints; a slide has a pin at its place."""
    slides = slides or {}
    joints = [
        joint(name, place, (GROUNDED if name in ground else 0) | (INPUT if name == first else 0))
        for name, place in places.items()
    ]
    joints += [joint(f"{pin}s", places[pin], PRISMATIC | GROUNDED, angle) for pin, angle in slides.items()]
    links = []
    for name in bars:
        centre = tuple(sum(places[pin][k] for pin in name) / len(name) for k in (0, 1))
        links.append(bar(name, name, 2.0, 0.3, centre))
    links += [bar(f"block {pin}", (pin, f"{pin}s"), 1.5, 0.0, (0.0, 0.0), "YP") for pin in slides]
    return link(joints, links, **how)
