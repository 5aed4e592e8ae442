"""Friction: tangential force against slip speed, normal force and hidden states."""
