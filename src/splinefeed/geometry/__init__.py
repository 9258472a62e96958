"""Immutable NURBS curves and the paths made of them, without a clock."""
