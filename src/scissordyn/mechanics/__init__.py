"""Points and linear joints: equations of motion in natural coordinates, loose joints, energy books."""
