"""The commands of `gough`, one module each: `run` parses nothing, calls, prints, returns a code.

To add a command, write a function whose parameters are the options (the docstring's Args become
the help texts) and which returns the exit code, and put a line into COMMANDS; a dict of such
functions makes a family, as in `gough plot pose`. A command stands in `gough/commands/NAME.py`, or
in the room whose work it starts.
"""

from __future__ import annotations

# name -> module, function, one line of help; a module is imported when its command is called
COMMANDS = {
    "solve": ("gough.commands.solve", "run", "poses from a file of leg readings"),
    "inverse": ("gough.commands.inverse", "run", "leg readings from a file of poses"),
    "modes": ("gough.commands.modes", "run", "every pose that leg readings allow, each proven"),
    "plot": ("gough.commands.plot", "FIGURES", "figures of poses, modes, workspaces and files"),
    "view": ("gough.commands.view", "run", "a machine in the browser, to look at and to drive"),
    "platforms": (
        "gough.commands.platforms", "run", "the machines that come with gough, as TOML to edit",
    ),
    "dataset": ("gough.commands.learn", "dataset", "poses and readings to learn from"),
    "train": ("gough.commands.learn", "train", "a network that guesses poses of your platform"),
    "evaluate": ("gough.commands.learn", "evaluate", "first guesses side by side"),
    "paper": ("gough.commands.paper", "run", "the DisGNet paper's experiments, run again"),
}  # fmt: skip
