"""What a user describes: bodies, joints, drives, gravity, mechanisms. Frozen; nothing here computes a motion."""
