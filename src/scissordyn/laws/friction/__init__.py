"""Friction: tangential force against slip speed, normal force and internal states."""
