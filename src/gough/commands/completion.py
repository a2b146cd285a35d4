"""gough --print-completion: a script that completes commands, options and files in a shell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Union

import tyro
from tyro.conf import Suppress, subcommand

from gough.errors import GoughError

SHELLS = ("bash", "zsh", "fish")
Functions = Callable[..., int] | dict[str, Callable[..., int]]  # dict: a family of commands


def print_completion(shells: list[str], commands: Mapping[str, Functions]) -> None:
    """Print the script for a shell, and exit.

    Args:
        shells: the words that follow the option: one name of a shell.
        commands: the functions of all commands.

    Raises:
        GoughError: another shell, or none.
    """
    if len(shells) != 1 or shells[0] not in SHELLS:
        raise GoughError(f"--print-completion: expected one of {', '.join(SHELLS)}")
    tyro.cli(_union(commands), prog="gough", args=["--tyro-print-completion", *shells])


def _union(functions: Mapping[str, Functions]) -> Any:
    """A type whose members are subcommands."""
    members = [
        Annotated[_union(found), subcommand(name)]
        if isinstance(found, dict)
        else Annotated[Any, subcommand(name, constructor=found)]
        for name, found in functions.items()
    ]
    # a union needs two members
    return Union[(*members, Annotated[None, Suppress])]
