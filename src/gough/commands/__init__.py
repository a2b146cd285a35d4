"""The commands of `gough`, one module each; a command's function returns the exit code.

To add a command, write a function whose parameters are the options (the docstring's Args become
the help texts) and which returns the exit code, and add a line to COMMANDS. A dict of such
functions makes a family of commands, such as `gough plot pose`.
"""

from __future__ import annotations

# name -> module, function, one line of help; a module is imported when its command is called
COMMANDS = {
    "solve": ("gough.commands.solve", "run", "Poses from a file of leg readings."),
    "inverse": ("gough.commands.inverse", "run", "Leg readings from a file of poses."),
    "check": ("gough.commands.check", "run", "A machine's file and log examined for mistakes."),
    "modes": ("gough.commands.modes", "run", "Every pose that has given leg readings, proven."),
    "plan-poses": ("gough.commands.plan_poses", "run", "The poses to measure for a calibration."),
    "calibrate": ("gough.commands.calibrate", "run", "The machine as it is, from measured poses."),
    "plot": ("gough.commands.plot", "FIGURES", "Figures of poses, modes, workspaces and files."),
    "view": ("gough.commands.view", "run", "A machine in the browser, to look at and to move."),
    "platforms": (
        "gough.commands.platforms", "run", "The machines that come with gough, to copy and edit.",
    ),
    "warmup": ("gough.commands.warmup", "run", "Compile beforehand what first answers wait for."),
    "export": ("gough.commands.export", "FORMATS", "A machine for other programs, such as C."),
    "import": ("gough.commands.import_", "FORMATS", "A platform from a model for a simulator."),
    "dataset": ("gough.commands.dataset", "run", "Poses and leg readings to train networks on."),
    "train": ("gough.commands.train", "run", "Train a network that guesses a machine's poses."),
    "evaluate": ("gough.commands.evaluate", "run", "Compare the errors of first guesses."),
    "paper": ("gough.commands.paper", "run", "Repeat the experiments of the DisGNet paper."),
}  # fmt: skip
