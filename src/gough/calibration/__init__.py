"""Calibration: the geometry as it is, from measured poses; see docs/calibration.md."""
