"""Learned first guesses, and kinematics in PyTorch: data, networks, training, gradients.

`gough.learn.solve` and `gough.learn.leg_lengths` are differentiable; they load PyTorch when first
used. `gough.learn.newton` is the module of the DisGNet paper's second stage.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
