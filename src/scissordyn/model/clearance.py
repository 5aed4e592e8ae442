"""Clearances of joints and guides: surfaces, contact laws or impulses, lubrication."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple

from scissordyn.components.film.asperities import ASPERITY_STIFFNESS
from scissordyn.components.film.film import Film
from scissordyn.components.place import BodyPoint, Point
from scissordyn.components.port.declaration import Attachment, Ends, direction, frame, place
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.friction.coefficients import static_coefficient
from scissordyn.laws.friction.none import NoFriction
from scissordyn.laws.material import STEEL, Material
from scissordyn.laws.oil import COLD, TEMPERATURE_RANGE, Oil, oil_of
from scissordyn.model.body import check_place
from scissordyn.units import Meaning, Quantity, Sample, State, check_quantities, documented, quantities

LENGTH_RATIO_MIN, LENGTH_RATIO_MAX = 0.25, 4.0  # Range of length over diameter in the table of finite journal bearings

# Unit, bounds and help text of the parameter `roughness` of `Lubrication`
ROUGHNESS_QUANTITY = Quantity("m", above=0.0, maximum=1e-3, help="combined rms roughness sigma of both surfaces")
# Unit, bounds and help text of the parameter `asperities` of `Lubrication`
ASPERITIES_QUANTITY = Quantity("1", minimum=0.0, maximum=1.0, help="stiffness K of the asperities (Greenwood and Tripp)")

ROUGHNESS_RATIO_MAX = 0.1  # Largest ratio of surface roughness to clearance; the asperity force is a series in this ratio


@documented
@dataclass(frozen=True)
class Lubrication:
    """Oil film in a clearance, with metallic contact in parallel where the film is as thin as the surfaces are rough.

    The combined rms roughness of journal and bearing is sigma = sqrt(sigma_J^2 + sigma_B^2). An oil has a viscosity that
    depends on the temperature. Finite bearings are 0.25 to 4 diameters long. Negative pressures can be included for short and
    long bearings.

    Raises
    ------
    InputError
        If neither oil nor viscosity is given, or both are.
    """

    oil: Annotated[Oil | None, Meaning("an oil by name, or its viscosities", '"ISO VG 46"')] = None
    viscosity: Annotated[float | None, Quantity("Pa s", above=0.0, maximum=1e4, help="dynamic viscosity mu")] = None
    temperature: Annotated[
        float, Quantity("K", minimum=TEMPERATURE_RANGE[0], maximum=TEMPERATURE_RANGE[1], help="temperature of the oil")
    ] = COLD
    roughness: Annotated[float, ROUGHNESS_QUANTITY] = 1e-6
    asperities: Annotated[float, ASPERITIES_QUANTITY] = ASPERITY_STIFFNESS
    bearing: Annotated[Literal["finite", "short", "long"], Meaning("how the pressure is computed")] = "finite"
    full: Annotated[bool, Meaning("whether negative pressures count, as under a high ambient pressure")] = False
    density: Annotated[float, quantities(Oil)["density"]] = 870.0
    ambient_pressure: Annotated[float, Quantity("Pa", minimum=0.0, maximum=1e9, help="pressure around the joint")] = 101325.0
    vapour_pressure: Annotated[float, Quantity("Pa", minimum=0.0, maximum=1e7, help="vapour pressure, 0 if unknown")] = 0.0

    def __post_init__(self) -> None:
        what: object = self.oil
        if isinstance(what, str):
            object.__setattr__(self, "oil", oil_of(what))
        check_quantities(self)
        if (self.oil is None) == (self.viscosity is None):
            what = "neither oil nor viscosity" if self.oil is None else "an oil and a viscosity"
            raise InputError(f"lubrication has {what}", "one of them", 'viscosity=0.05 for 50 mPa s, or oil="ISO VG 46"')
        if self.full and self.bearing == "finite":
            raise InputError('full = True with a "finite" bearing, whose table has no negative pressures', '"short" or "long"')

    @property
    def dynamic_viscosity(self) -> float:
        """Dynamic viscosity mu at the temperature [Pa s]."""
        if self.oil is not None:
            return self.oil.viscosity(self.temperature)
        assert self.viscosity is not None
        return self.viscosity

    @property
    def mass_density(self) -> float:
        """Density rho of the oil [kg/m^3]."""
        return self.density if self.oil is None else self.oil.density

    def check(self, clearance: float, radius: float, length: float) -> None:
        """Raise `InputError` if a joint is too rough, too short or too long for the film."""
        if self.roughness > ROUGHNESS_RATIO_MAX * clearance:
            raise InputError(
                f"lubrication with roughness = {self.roughness:g} m in a clearance of {clearance:g} m",
                "a combined rms roughness of at most a tenth of the clearance",
                Sample("roughness", 0.01 * clearance, "m"),
            )
        ratio = 0.5 * length / radius
        if self.bearing == "finite" and not LENGTH_RATIO_MIN <= ratio <= LENGTH_RATIO_MAX:
            other = "short" if ratio < LENGTH_RATIO_MIN else "long"
            raise InputError(
                f'bearing = "finite": the bearing is {ratio:.3g} diameters long',
                f"{LENGTH_RATIO_MIN:g} to {LENGTH_RATIO_MAX:g} diameters",
                f'bearing="{other}"',
            )

    def film(self, name: str, bearing: BodyPoint, journal: BodyPoint, surfaces: JointContact) -> Film:
        """Return the component that exerts the force of film and asperities in a joint."""
        size = surfaces.clearance, surfaces.journal_radius, surfaces.length
        modulus = self.asperities / surfaces.compliance
        return Film(name, bearing, journal, self.dynamic_viscosity, *size, self.roughness, modulus, self.bearing, self.full)


ContactKind = Annotated[
    Literal["compliant", "hard"], Meaning("forces by the laws, or impulses with their restitution and friction")
]

MEAN_FRICTION = State("mean_friction", "N", scale=1.0)
"""Internal state of a hard contact: mean friction force over the last step."""

STORED_ENERGY = State("stored_energy", "J", scale=1.0)  # Internal state of a hard contact: elastic energy at the end of a step
HARD_STATES = (MEAN_FRICTION, STORED_ENERGY)  # Internal states of a hard contact, in their order in the state

_HARD_COEFFICIENTS = ("kinetic", "static")  # Parameters of a friction law on which hard contacts depend


class HardNumbers(NamedTuple):
    """Parameters of a hard contact."""

    restitution: float  # Newton's coefficient e [1]
    kinetic: float  # Coulomb's coefficient mu_k of kinetic friction [1]
    static: float  # Coulomb's coefficient mu_s of static friction [1]


def check_hard(clearance: Clearance | GuideClearance) -> None:
    """Raise `InputError` for options that a hard contact does not support."""
    if clearance.contact != "hard":
        return
    if getattr(clearance, "lubrication", None) is not None:
        raise _unsupported("lubrication", "a dry joint", 'contact = "compliant"')
    if getattr(clearance, "slip", "surfaces") != "surfaces":
        raise _unsupported("slip of the contact points", "that of the surfaces")
    damping, friction = clearance.damping, clearance.friction
    if not isinstance(damping, DampingFactor):
        raise _unsupported(f"damping law '{damping.name}'", "a restitution coefficient", "restitution = 0.7")
    if isinstance(friction, NoFriction):
        return
    if not hasattr(friction, "kinetic"):
        raise _unsupported(f"friction law '{friction.name}'", "a kinetic and a static coefficient", 'friction = "none"')
    part: Any = friction
    for parameter in dataclasses.fields(part):
        value = getattr(friction, parameter.name)
        if parameter.name not in _HARD_COEFFICIENTS and value != parameter.default:
            raise _unsupported(f"{parameter.name} = {value!r} of friction law '{friction.name}'", "kinetic and static only")


def _unsupported(what: str, allowed: str, sample: str = "") -> InputError:
    """Return the error for an option that a hard contact does not support."""
    return InputError(f"{what}: not supported by a hard contact", allowed, sample)


def hard_numbers(clearance: Clearance | GuideClearance) -> HardNumbers:
    """Return restitution and friction coefficients of a hard contact."""
    damping, friction = clearance.damping, clearance.friction
    restitution = float(getattr(damping, "restitution", 0.0))
    kinetic = float(getattr(friction, "kinetic", 0.0))
    static = static_coefficient(friction.name, kinetic, friction.static) if hasattr(friction, "static") else kinetic
    return HardNumbers(restitution, kinetic, static)


def contact_states(clearance: Clearance | GuideClearance) -> tuple[State, ...]:
    """Return the internal states of a contact: friction, then damping; for hard contact mean friction and elastic energy."""
    return HARD_STATES if clearance.contact == "hard" else (*clearance.friction.states, *clearance.damping.states)


SlipKind = Annotated[
    Literal["surfaces", "contact-points"], Meaning("slip speed of the surfaces, or of the points where they touch")
]


ReferenceKind = Annotated[
    Literal["loaded", "onset"],
    Meaning("speed that damping refers to: at the onset, or more in a contact that is loaded later"),
]


ANGLES_MIN = 90  # Smallest number of angles in a worn contour: 4 deg each; the loaded arc of a bearing spans several degrees

# Unit and help text of the parameter `contour` of `Clearance`
CONTOUR_QUANTITY = Quantity("m", help="depths of the worn bearing at equal angles, from the direction of its body")
# Unit and help text of the parameter `journal_contour` of `Clearance`
JOURNAL_CONTOUR_QUANTITY = Quantity("m", help="depths of the worn journal at equal angles, from the direction of its body")
# Unit, bounds and help text of the parameter `wear` of `Clearance`
WEAR_QUANTITY = Quantity("m^2/N", above=0.0, maximum=1e-6, help="worn volume of the bearing per load and distance (Archard)")
# Unit, bounds and help text of the parameter `journal_wear` of `Clearance`
JOURNAL_WEAR_QUANTITY = Quantity(
    "m^2/N", above=0.0, maximum=1e-6, help="worn volume of the journal per load and distance (Archard)"
)


@documented
@dataclass(frozen=True)
class Clearance:
    """Revolute clearance joint: a journal that is smaller than its bearing by the radial clearance.

    Damping laws divide the rate of the indentation by the approach speed of an impact. This does not describe a contact that
    begins slowly and is loaded later. With reference "loaded", the rate is divided by the speed that corresponds to the
    contact's kinetic and elastic energy; free impacts are unchanged. With "onset", it is always divided by the approach speed,
    as published.

    Hard contact replaces forces by impulses, with the restitution of the damping law and the coefficients of the friction law.
    The slip speed is that of the surfaces. For comparison with some papers it can be that of the contact points, which do not
    rotate with the bodies, so that nearly all sliding is lost.
    """

    clearance: Annotated[float, Quantity("m", above=0.0, help="radial clearance c = R_B - R_J")]
    journal_radius: Annotated[float, Quantity("m", above=0.0, help="radius R_J of the journal")] = 10e-3
    bearing_length: Annotated[float, Quantity("m", above=0.0, help="axial length L_b of the bearing")] = 15e-3
    material: Annotated[Material, Meaning("material of the journal; of the bearing too, unless that is given", "STEEL")] = STEEL
    bearing_material: Annotated[Material | None, Meaning("material of the bearing")] = None
    stiffness: Annotated[Elastic, Meaning("an elastic law", "Liu()")] = field(default_factory=Liu)
    damping: Annotated[Damping, Meaning("a damping law", "Flores(restitution=0.9)")] = field(default_factory=Flores)
    friction: Annotated[Friction, Meaning("a friction law", "Ambrosio(kinetic=0.1)")] = field(default_factory=NoFriction)
    lubrication: Annotated[
        Lubrication | None, Meaning("an oil, or a table with its viscosity", "Lubrication(viscosity=0.05)")
    ] = None
    contact: ContactKind = "compliant"
    reference: ReferenceKind = "loaded"
    slip: SlipKind = "surfaces"
    wear: Annotated[float | None, WEAR_QUANTITY] = None
    bush: Annotated[float | None, Quantity("m", above=0.0, help="thickness of the bush, which wear may use up")] = None
    contour: Annotated[tuple[float, ...], CONTOUR_QUANTITY] = ()
    journal_wear: Annotated[float | None, JOURNAL_WEAR_QUANTITY] = None
    journal_contour: Annotated[tuple[float, ...], JOURNAL_CONTOUR_QUANTITY] = ()

    def __post_init__(self) -> None:
        check_quantities(self)
        for name in ("contour", "journal_contour"):
            if getattr(self, name):
                self._check_contour(name)
        if self.clearance >= self.journal_radius:
            raise InputError(
                f"clearance = {self.clearance:g} m is not smaller than journal_radius = {self.journal_radius:g} m",
                "a clearance smaller than the journal radius",
                Sample("clearance", min(0.05 * self.journal_radius, 5e-4), "m"),
            )
        if self.lubrication is not None:
            self.lubrication.check(self.clearance, self.journal_radius, self.bearing_length)
        check_hard(self)

    @property
    def wears(self) -> bool:
        """True if the bearing or the journal has a coefficient of wear."""
        return (self.wear, self.journal_wear) != (None, None)

    @property
    def is_worn(self) -> bool:
        """True if the bearing or the journal has a contour."""
        return bool(self.contour or self.journal_contour)

    def _check_contour(self, name: str) -> None:
        """Raise `InputError` for too few or impossible depths of a worn surface, or a contact without wear."""
        depths = getattr(self, name)
        if len(depths) < ANGLES_MIN:
            raise InputError(f"{name}: {len(depths)} depths", f"at least {ANGLES_MIN} depths, at equally spaced angles")
        if not all(0.0 <= depth < self.journal_radius for depth in depths):
            raise InputError(f"{name}: a depth that is negative or not below the journal radius", "depths of the worn surface")
        self.check_worn(name)

    def check_worn(self, what: str) -> None:
        """Raise `InputError` if bearings with this contact cannot wear; `what` names the joint or the option in the message."""
        if self.lubrication is not None or self.slip != "surfaces":
            raise InputError(
                f"{what}: wear of a joint with lubrication or slip of the contact points",
                "a dry contact with the slip of the surfaces",
                'slip = "surfaces"',
            )

    @property
    def surfaces(self) -> JointContact:
        """Both surfaces, as input of the laws."""
        return JointContact(
            clearance=self.clearance,
            journal_radius=self.journal_radius,
            length=self.bearing_length,
            journal=self.material,
            bearing=self.material if self.bearing_material is None else self.bearing_material,
        )


@documented
@dataclass(frozen=True)
class GuideClearance:
    """Clearance guide: a block in a wider channel; its rounded corners touch the two guide surfaces.

    The clearance is c = (H - W)/2 with H the width of the channel and W that of the block (Flores, Ambrosio, Claro and
    Lankarani 2008, doi:10.1115/1.2802113). A rectangular block is centred on the guided point and aligned with the guide at the
    start. Corners can be given in the follower's frame instead. A corner to the left of the guided point, seen along the guide,
    faces the left guide surface. Each surface is at the distance c from the nearest corner that faces it. Around a pole, each
    corner faces the surface on its own side from outside. The elastic law needs parameters for a plane surface: hertz,
    braendlein, power, linear, or a law of your own. Hard contact and `reference` are as in a `Clearance`.
    """

    clearance: Annotated[float, Quantity("m", above=0.0, help="gap on either side of the centred block, (H - W)/2")]
    length: Annotated[float | None, Quantity("m", above=0.0, help="length of the block, along the guide")] = None
    width: Annotated[float | None, Quantity("m", above=0.0, help="width of the block, across the guide")] = None
    corners: Annotated[tuple[Point, ...], Meaning("centres of rounded corners, instead of length and width")] = ()
    corner_radius: Annotated[float, Quantity("m", above=0.0, help="radius of the block's corners")] = 1e-3
    around: Annotated[bool, Meaning("whether the follower surrounds the guide, as a ring does a pole")] = False
    thickness: Annotated[float, Quantity("m", above=0.0, help="length of the corners' edges")] = 15e-3
    material: Annotated[Material, Meaning("material of the block; of the guide too, unless that is given", "STEEL")] = STEEL
    guide_material: Annotated[Material | None, Meaning("material of the guide")] = None
    stiffness: Annotated[Elastic, Meaning("an elastic law", "Hertz()")] = field(default_factory=Hertz)
    damping: Annotated[Damping, Meaning("a damping law", "Flores(restitution=0.9)")] = field(default_factory=Flores)
    friction: Annotated[Friction, Meaning("a friction law", "Ambrosio(kinetic=0.1)")] = field(default_factory=NoFriction)
    contact: ContactKind = "compliant"
    reference: ReferenceKind = "loaded"

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.corners:
            if self.length is not None or self.width is not None:
                raise InputError("a clearance guide with corners and length or width", "either corners, or length and width")
            for point in self.corners:
                check_place("corner", point)
        elif self.length is None or self.width is None:
            raise InputError("a clearance guide whose block has no size", "length and width, or corners")
        elif 2.0 * self.corner_radius > min(self.length, self.width):
            raise InputError(
                f"corner_radius = {self.corner_radius:g} m is too large for a block of {self.length:g} m by {self.width:g} m",
                f"at most {0.5 * min(self.length, self.width):g} m",
            )
        self._check_stiffness()
        check_hard(self)

    def _check_stiffness(self) -> None:
        """Raise `InputError` for a law without finite parameters at infinite bearing radius."""
        try:
            numbers = self.stiffness.parameters(self.surfaces)
        except (ArithmeticError, InputError):
            numbers = (math.nan,)
        if not all(math.isfinite(number) for number in numbers):
            raise InputError(
                f"stiffness law '{self.stiffness.name}' in a clearance guide: it describes a journal in a bearing and "
                "has no value for a corner on a plane guide surface",
                "hertz, braendlein, power, linear or a user-defined function",
            )

    @property
    def surfaces(self) -> JointContact:
        """Radii, materials and gap of a rounded corner on its guide surface, for the contact laws."""
        return JointContact(
            clearance=math.inf,
            journal_radius=self.corner_radius,
            length=self.thickness,
            journal=self.material,
            bearing=self.material if self.guide_material is None else self.guide_material,
            gap=self.clearance,
        )

    def centres(self, guided: Point, direction: float) -> tuple[Point, ...]:
        """Return the centres of the corners in the follower's frame [m].

        Parameters
        ----------
        guided : (float, float)
            Guided point in that frame [m].
        direction : float
            Direction of the guide in that frame at the start [rad].
        """
        if self.length is None or self.width is None:
            return self.corners
        half, side = 0.5 * self.length - self.corner_radius, 0.5 * self.width - self.corner_radius
        cos, sin = math.cos(direction), math.sin(direction)
        ends = ((-half, -side), (half, -side), (half, side), (-half, side))
        return tuple((guided[0] + cos * x - sin * y, guided[1] + sin * x + cos * y) for x, y in ends)


@dataclass(frozen=True)
class ContactPoint:
    """Contact point of a clearance guide: a rounded corner of the block and the guide surface that it faces."""

    name: str  # "GUIDE/corner 1", "GUIDE/corner 2", ...
    guide: str  # Name of the guide
    follower: str  # Body that the corner belongs to
    centre: Point  # Centre of the corner's arc, in the follower's frame [m]
    body: str  # Body that carries the guide, or the ground
    through: Point  # Point of the guide's line, in the frame of that body [m]
    normal: Point  # Unit vector across the guide from the corner towards the guide surface, in that frame
    # Distance of the guide surface from the guide's line along the normal [m]; negative for a pole inside a ring
    distance: float
    clearance: GuideClearance

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """Vector from the guide's line to the corner's centre, direction of the block, frame of the guide."""
        ends = place((self.follower, self.centre)), place((self.body, self.through), -1.0)
        return (*ends, direction(2, self.follower), frame(4, self.body))

    @property
    def ends(self) -> Ends:
        """Points on which the contact force acts, the block first."""
        return (self.follower, self.centre), (self.body, self.through)
