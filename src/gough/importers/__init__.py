"""Platforms found in models for simulators: bodies and joints read, six legs found among them."""
