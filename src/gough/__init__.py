"""Forward kinematics of Gough-Stewart platforms (hexapods): poses from leg readings.

The public names stand in `__init__.pyi`; each loads its module when it is first used, so that
`import gough` is quick.
"""

from __future__ import annotations

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, _names = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_names]  # pyright: ignore[reportUnsupportedDunderAll]
