"""Pictures of hexapods and of files, for reports: print, screens, colour-blind readers.

    from gough.plot import pose_figure, save
    save(pose_figure(platform, pose), "pose.svg")

A `*_figure` makes a whole matplotlib `Figure`; a `draw_*` draws into given axes. Neither touches
pyplot. The extra `plot` installs matplotlib. The public names stand in `__init__.pyi`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
