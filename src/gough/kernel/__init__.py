"""Compiled code: all that Numba compiles, and the arrays that it works on."""
