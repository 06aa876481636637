"""Matrices: beams, bodies, joints, assembly."""
