"""Dynamics of deployable scissor structures, and of any planar mechanism, with clearance, contact and friction in joints."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

PUBLIC = {
    "analysis.agreement": ("Measured",),
    "analysis.contact": ("contact_statistics",),
    "analysis.motor": ("MotorCurve", "figures_of_merit", "torque_over_speed"),
    "analysis.section": ("section", "stroboscopic"),
    "analysis.spectrum": ("spectrum",),
    "analysis.verdict": ("classify", "consensus"),
    "analysis.zero_one": ("zero_one_test",),
    "casefile.case": ("Case",),
    "casefile.case_text": ("case_text",),
    "collection.catalogue": ("zoo",),
    "components.actuator": ("Actuator",),
    "components.angle_load": ("AngleLoad",),
    "components.angle_stop": ("AngleStop",),
    "components.beam": ("Beam",),
    "components.bushing": ("Bushing",),
    "components.cable": ("Cable",),
    "components.cam": ("Cam",),
    "components.clutch": ("Clutch",),
    "components.constant_force_spring": ("ConstantForceSpring",),
    "components.declaration": ("component",),
    "components.drag": ("Drag",),
    "components.edge_contact": ("EdgeContact",),
    "components.element": ("element",),
    "components.flexible_bar": ("FlexibleBar",),
    "components.force": ("Force",),
    "components.gas_spring": ("GasSpring",),
    "components.guide_friction": ("GuideFriction",),
    "components.latch": ("Latch",),
    "components.linear_motor": ("LinearMotor",),
    "components.lugre": ("GuideLuGre", "PinLuGre"),
    "components.motor": ("Motor",),
    "components.nonlinear_spring": ("NonlinearSpring",),
    "components.pin_friction": ("PinFriction",),
    "components.port": ("Output",),
    "components.rod": ("Rod",),
    "components.roller": ("Roller",),
    "components.spring": ("Spring",),
    "components.stroke_load": ("StrokeLoad",),
    "components.tabulated_motor": ("TabulatedMotor",),
    "components.tape_spring": ("TapeSpring",),
    "components.time_function": (
        "ConstantSpeed",
        "Cycloidal",
        "Harmonic",
        "Polynomial",
        "Tabulated",
        "Trapezoidal",
        "tabulated",
    ),
    "components.torque": ("Torque",),
    "components.torsion_spring": ("TorsionSpring",),
    "components.travel_stop": ("TravelStop",),
    "config.file": ("read_case", "write_case"),
    "config.fits": ("fit", "least_value"),
    "config.studies": ("open_study", "study"),
    "control.catalogue": ("controller",),
    "control.delayed.extended": ("ExtendedDelayedFeedback",),
    "control.delayed.pyragas": ("Pyragas",),
    "control.tracking.feed_forward": ("FeedForward",),
    "control.tracking.none": ("NoControl",),
    "control.tracking.pid": ("PID",),
    "equilibrium.buckling": ("buckling",),
    "equilibrium.modes": ("modes",),
    "equilibrium.statics": ("statics",),
    "errors": ("InputError", "ScissordynError"),
    "exchange.dxf": ("read_dxf",),
    "exchange.export": ("export",),
    "exchange.forces": ("pin_forces",),
    "exchange.linkage2": ("read_linkage2",),
    "exchange.mjcf": ("read_mjcf",),
    "exchange.pmks": ("read_pmks",),
    "exchange.points": ("read_points",),
    "exchange.read": ("read_drawing",),
    "exchange.slvs": ("read_slvs",),
    "identification.prediction": ("prediction",),
    "kinematics.bending": ("with_bending",),
    "laws.catalogue": ("law",),
    "laws.damping.factors": ("Flores", "LankaraniNikravesh"),
    "laws.elastic.hertz": ("Hertz",),
    "laws.elastic.liu": ("Liu",),
    "laws.friction.ambrosio": ("Ambrosio",),
    "laws.friction.lugre": ("LuGre",),
    "laws.friction.none": ("NoFriction",),
    "laws.material": ("Material", "STEEL"),
    "laws.oil": ("Oil",),
    "model.addition": ("with_backlash", "with_joint_friction", "with_panels", "with_payload"),
    "model.body": ("Body", "Track", "bar", "point_mass"),
    "model.clearance": ("Clearance", "GuideClearance", "Lubrication"),
    "model.coupling": (
        "Belt",
        "CoordinateDrive",
        "Coupling",
        "Distance",
        "Drive",
        "FurtherInput",
        "RelativeAngle",
        "Screw",
        "Slide",
        "Teeth",
    ),
    "model.joint": ("Guide", "Revolute", "Weld"),
    "model.linkage": ("common_pin", "four_bar", "n_four_bar", "slider_crank"),
    "model.mechanism": ("Mechanism",),
    "model.options": ("Options",),
    "model.scissor": ("angulated_bar", "hoberman_ring", "mast", "polar_scissor", "scissor"),
    "model.section": ("Section", "StructuralMaterial"),
    "model.wear": ("Wear",),
    "periodic.bifurcation": ("bifurcation",),
    "periodic.cycles": ("cycle",),
    "periodic.ensemble": ("ensemble",),
    "periodic.lyapunov": ("separation_exponent", "variational_exponent"),
    "lifetime.wear": ("wear",),
    "plot.animation": ("animate",),
    "plot.canvas": ("view",),
    "plot.preview": ("preview",),
    "plot.style": ("style",),
    "record.internal_forces": ("internal_forces",),
    "record.store": ("load", "save"),
    "run.advance.checkpoint": ("Checkpoint",),
    "run.batch": ("simulate_many",),
    "run.engine": ("Processes",),
    "run.ideal": ("ideal_kinematics",),
    "run.inverse_dynamics": ("constrain_contact", "feed_forward", "inverse_dynamics"),
    "run.simulate": ("replay", "simulate"),
    "studies.ask.distribution": ("Empirical", "Interval", "Levels", "Names"),
    "studies.ask.iso_286": ("Fit",),
    "sensitivity.gradient": ("gradient",),
    "studies.compute.convergence": ("convergence",),
    "units": ("Pairs", "Quantity", "State", "degrees", "rpm"),
}
"""Public names by module; a name is imported when it is first used. `__init__.pyi` has the same names for type checkers."""

MODULE_OF = {name: module for module, names in PUBLIC.items() for name in names}

__all__ = sorted([*MODULE_OF, "plot"], key=lambda name: (not name.isupper(), not name[0].isupper(), name))


def __getattr__(name: str) -> Any:
    if name == "plot":
        return import_module("scissordyn.plot")
    from scissordyn.lookup import public

    value = globals()[name] = public("scissordyn", name, MODULE_OF)
    return value


def __dir__() -> list[str]:
    return ["__version__", *__all__]
