"""Dynamics of deployable scissor structures, and of any planar mechanism, with joints as they really are."""
