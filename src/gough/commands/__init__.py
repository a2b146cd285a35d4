"""The commands of `gough`, one module each: `run` parses nothing, calls, prints, returns a code.

To add a command, write `gough/commands/NAME.py` with a function `run` whose parameters are the
options (the docstring's Args become the help texts) and which returns the exit code, and put a
line into COMMANDS.
"""

from __future__ import annotations

# name -> one line of help; modules are imported when their command is called
COMMANDS = {
    "solve": "poses from a file of leg readings",
    "inverse": "leg readings from a file of poses",
    "platforms": "the machines that come with gough, as TOML to copy and edit",
}
