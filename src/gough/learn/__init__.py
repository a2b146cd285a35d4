"""Learned first guesses: data, graphs, networks, training, export, evaluation (PyTorch)."""
