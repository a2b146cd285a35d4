"""Pictures of hexapods and of files, for reports: print, screens, colour-blind readers.

    from gough.plot import pose_figure, save
    save(pose_figure(platform, pose), "pose.svg")

A `*_figure` makes a whole matplotlib `Figure`; a `draw_*` draws into axes of your own. Neither
touches pyplot. The extra `plot` brings matplotlib.
"""

from __future__ import annotations

from gough.plot.envelope import Envelope
from gough.plot.histograms import LogHistogram, draw_histogram, histogram_figure
from gough.plot.modes import modes_figure
from gough.plot.pose import PoseStyle, draw_pose, pose_axes, pose_figure
from gough.plot.style import house_style, new_figure, save
from gough.plot.trajectory import trajectory_figure
from gough.plot.workspace import WorkspaceSlice, draw_slice, workspace_figure, workspace_slice

__all__ = [
    "Envelope",
    "LogHistogram",
    "PoseStyle",
    "WorkspaceSlice",
    "draw_histogram",
    "draw_pose",
    "draw_slice",
    "histogram_figure",
    "house_style",
    "modes_figure",
    "new_figure",
    "pose_axes",
    "pose_figure",
    "save",
    "trajectory_figure",
    "workspace_figure",
    "workspace_slice",
]
