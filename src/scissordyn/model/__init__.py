"""Description of a mechanism: bodies, joints, drives, gravity. Frozen dataclasses without computation."""
