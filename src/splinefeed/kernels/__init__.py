"""Numba kernels: the arithmetic of one point, one piece or one tick, on floats and contiguous float64 arrays."""
