"""Mechanics: equations of motion in natural coordinates, clearance joints, energy balance."""
