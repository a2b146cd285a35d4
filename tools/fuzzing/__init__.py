"""Damaged and hostile inputs for gough, and an independent judge of its answers."""
