"""Kinematics of ideal mechanisms: paths, singular positions, branches of the assembly, transmission angles."""
