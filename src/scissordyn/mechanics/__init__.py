"""Points and linear joints: equations of motion in natural coordinates, clearance joints, energy balance."""
