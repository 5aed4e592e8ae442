"""Public names and their modules, for type checkers; `PUBLIC` in `__init__.py` has the same for the import."""

from scissordyn import plot as plot
from scissordyn.analysis.agreement import Measured as Measured
from scissordyn.analysis.contact import contact_statistics as contact_statistics
from scissordyn.analysis.motor import (
    MotorCurve as MotorCurve,
    figures_of_merit as figures_of_merit,
    torque_over_speed as torque_over_speed,
)
from scissordyn.analysis.section import section as section, stroboscopic as stroboscopic
from scissordyn.analysis.spectrum import spectrum as spectrum
from scissordyn.analysis.verdict import classify as classify, consensus as consensus
from scissordyn.analysis.zero_one import zero_one_test as zero_one_test
from scissordyn.collection.catalogue import zoo as zoo
from scissordyn.components.actuator import Actuator as Actuator
from scissordyn.components.angle_load import AngleLoad as AngleLoad
from scissordyn.components.angle_stop import AngleStop as AngleStop
from scissordyn.components.beam import Beam as Beam
from scissordyn.components.bushing import Bushing as Bushing
from scissordyn.components.cable import Cable as Cable
from scissordyn.components.cam import Cam as Cam
from scissordyn.components.clutch import Clutch as Clutch
from scissordyn.components.constant_force_spring import ConstantForceSpring as ConstantForceSpring
from scissordyn.components.declaration import component as component
from scissordyn.components.drag import Drag as Drag
from scissordyn.components.edge_contact import EdgeContact as EdgeContact
from scissordyn.components.element import element as element
from scissordyn.components.flexible_bar import FlexibleBar as FlexibleBar
from scissordyn.components.force import Force as Force
from scissordyn.components.gas_spring import GasSpring as GasSpring
from scissordyn.components.guide_friction import GuideFriction as GuideFriction
from scissordyn.components.latch import Latch as Latch
from scissordyn.components.linear_motor import LinearMotor as LinearMotor
from scissordyn.components.lugre import GuideLuGre as GuideLuGre
from scissordyn.components.lugre import PinLuGre as PinLuGre
from scissordyn.components.motor import Motor as Motor
from scissordyn.components.nonlinear_spring import NonlinearSpring as NonlinearSpring
from scissordyn.components.pin_friction import PinFriction as PinFriction
from scissordyn.components.port import Output as Output
from scissordyn.components.rod import Rod as Rod
from scissordyn.components.roller import Roller as Roller
from scissordyn.components.spring import Spring as Spring
from scissordyn.components.stroke_load import StrokeLoad as StrokeLoad
from scissordyn.components.tabulated_motor import TabulatedMotor as TabulatedMotor
from scissordyn.components.tape_spring import TapeSpring as TapeSpring
from scissordyn.components.time_function import (
    ConstantSpeed as ConstantSpeed,
    Cycloidal as Cycloidal,
    Harmonic as Harmonic,
    Polynomial as Polynomial,
    Tabulated as Tabulated,
    Trapezoidal as Trapezoidal,
    tabulated as tabulated,
)
from scissordyn.components.torque import Torque as Torque
from scissordyn.components.torsion_spring import TorsionSpring as TorsionSpring
from scissordyn.components.travel_stop import TravelStop as TravelStop
from scissordyn.casefile.case import Case as Case
from scissordyn.casefile.case_text import case_text as case_text
from scissordyn.config.file import read_case as read_case, write_case as write_case
from scissordyn.config.fits import fit as fit, least_value as least_value
from scissordyn.config.studies import open_study as open_study, study as study
from scissordyn.control.catalogue import controller as controller
from scissordyn.control.delayed.extended import ExtendedDelayedFeedback as ExtendedDelayedFeedback
from scissordyn.control.delayed.pyragas import Pyragas as Pyragas
from scissordyn.control.tracking.feed_forward import FeedForward as FeedForward
from scissordyn.control.tracking.none import NoControl as NoControl
from scissordyn.control.tracking.pid import PID as PID
from scissordyn.errors import InputError as InputError, ScissordynError as ScissordynError
from scissordyn.exchange.dxf import read_dxf as read_dxf
from scissordyn.exchange.export import export as export
from scissordyn.exchange.forces import pin_forces as pin_forces
from scissordyn.exchange.linkage2 import read_linkage2 as read_linkage2
from scissordyn.exchange.mjcf import read_mjcf as read_mjcf
from scissordyn.exchange.pmks import read_pmks as read_pmks
from scissordyn.exchange.points import read_points as read_points
from scissordyn.exchange.read import read_drawing as read_drawing
from scissordyn.exchange.slvs import read_slvs as read_slvs
from scissordyn.identification.prediction import prediction as prediction
from scissordyn.laws.catalogue import law as law
from scissordyn.laws.damping.factors import Flores as Flores, LankaraniNikravesh as LankaraniNikravesh
from scissordyn.laws.elastic.hertz import Hertz as Hertz
from scissordyn.laws.elastic.liu import Liu as Liu
from scissordyn.laws.friction.ambrosio import Ambrosio as Ambrosio
from scissordyn.laws.friction.lugre import LuGre as LuGre
from scissordyn.laws.friction.none import NoFriction as NoFriction
from scissordyn.laws.material import STEEL as STEEL, Material as Material
from scissordyn.laws.oil import Oil as Oil
from scissordyn.model.addition import (
    with_backlash as with_backlash,
    with_joint_friction as with_joint_friction,
    with_panels as with_panels,
    with_payload as with_payload,
)
from scissordyn.kinematics.bending import with_bending as with_bending
from scissordyn.model.body import Body as Body, Track as Track, bar as bar, point_mass as point_mass
from scissordyn.model.clearance import Clearance as Clearance
from scissordyn.model.coupling import (
    Belt as Belt,
    CoordinateDrive as CoordinateDrive,
    Coupling as Coupling,
    Distance as Distance,
    Drive as Drive,
    FurtherInput as FurtherInput,
    RelativeAngle as RelativeAngle,
    Screw as Screw,
    Slide as Slide,
    Teeth as Teeth,
)
from scissordyn.model.clearance import GuideClearance as GuideClearance
from scissordyn.model.joint import Guide as Guide, Revolute as Revolute, Weld as Weld
from scissordyn.model.linkage import (
    common_pin as common_pin,
    four_bar as four_bar,
    n_four_bar as n_four_bar,
    slider_crank as slider_crank,
)
from scissordyn.model.clearance import Lubrication as Lubrication
from scissordyn.model.mechanism import Mechanism as Mechanism
from scissordyn.model.scissor import (
    angulated_bar as angulated_bar,
    hoberman_ring as hoberman_ring,
    mast as mast,
    polar_scissor as polar_scissor,
    scissor as scissor,
)
from scissordyn.model.section import Section as Section, StructuralMaterial as StructuralMaterial
from scissordyn.model.wear import Wear as Wear
from scissordyn.periodic.bifurcation import bifurcation as bifurcation
from scissordyn.periodic.cycles import cycle as cycle
from scissordyn.periodic.ensemble import ensemble as ensemble
from scissordyn.periodic.lyapunov import (
    separation_exponent as separation_exponent,
    variational_exponent as variational_exponent,
)
from scissordyn.lifetime.wear import wear as wear
from scissordyn.plot.animation import animate as animate
from scissordyn.plot.canvas import view as view
from scissordyn.plot.preview import preview as preview
from scissordyn.plot.style import style as style
from scissordyn.run.batch import simulate_many as simulate_many
from scissordyn.equilibrium.buckling import buckling as buckling
from scissordyn.run.advance.checkpoint import Checkpoint as Checkpoint
from scissordyn.run.inverse_dynamics import constrain_contact as constrain_contact
from scissordyn.run.engine import Processes as Processes
from scissordyn.run.inverse_dynamics import feed_forward as feed_forward
from scissordyn.run.ideal import ideal_kinematics as ideal_kinematics
from scissordyn.record.internal_forces import internal_forces as internal_forces
from scissordyn.equilibrium.modes import modes as modes
from scissordyn.run.inverse_dynamics import inverse_dynamics as inverse_dynamics
from scissordyn.equilibrium.statics import statics as statics
from scissordyn.model.options import Options as Options
from scissordyn.run.simulate import replay as replay, simulate as simulate
from scissordyn.record.store import load as load, save as save
from scissordyn.sensitivity.gradient import gradient as gradient
from scissordyn.studies.compute.convergence import convergence as convergence
from scissordyn.studies.ask.distribution import (
    Empirical as Empirical,
    Interval as Interval,
    Levels as Levels,
    Names as Names,
)
from scissordyn.studies.ask.iso_286 import Fit as Fit
from scissordyn.units import Pairs as Pairs, Quantity as Quantity, State as State, degrees as degrees, rpm as rpm

__version__: str
