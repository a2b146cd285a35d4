"""The command line: find the command, parse its options, print errors as one line."""

from __future__ import annotations

import inspect
import logging
import os
import re
import signal
import sys
import textwrap
from contextlib import suppress
from importlib import import_module

import gough
from gough.commands import COMMANDS, signals
from gough.errors import GoughError, suggestion

BAD_USAGE, BROKEN_PIPE = 2, 141
WIDTH = 79  # of help texts
EXTRAS = {"matplotlib": "plot", "viser": "view"} | dict.fromkeys(
    ("torch", "roma", "safetensors", "onnx", "onnxscript", "scipy", "tensorboard"), "learn"
)


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit.

    Exit codes: 0 all rows have a usable result; 1 some have not; 2 bad usage, unreadable input
    or unwritable output; 130 Ctrl-C; 141 the reader of a pipe is gone; 143 asked to terminate.
    """
    given = sys.argv[1:] if arguments is None else arguments
    notes = logging.StreamHandler()  # what readers of files recognised, on standard error
    logging.getLogger("gough").addHandler(notes)
    signals.listen()
    code = _run(given)
    signals.ignore()
    logging.getLogger("gough").removeHandler(notes)
    sys.exit(code)


def _run(arguments: list[str]) -> int:
    """Run a command and return its exit code, also after an error."""
    name = " ".join(["gough", *[a for a in arguments[:1] if a in COMMANDS]])
    try:
        code = _call_command(arguments)
        sys.stdout.flush()
        return code
    except GoughError as error:
        return _print_error(f"{name}: error: {error}")
    except signals.Stopped as stop:
        return _stopped(name, stop.number)
    except BrokenPipeError:
        _drop_output()
        return BROKEN_PIPE
    except MemoryError:
        return _print_error(f"{name}: error: not enough memory; pass a smaller --block-rows")
    except OSError as error:
        _drop_output()
        where = f"{error.filename}: " if error.filename else ""
        return _print_error(f"{name}: error: {where}{error.strerror or error}")
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        extra = EXTRAS.get(package)
        if extra is None:
            raise
        return _print_error(
            f"{name}: error: needs {package}, which is not installed; install it with: "
            f"pip install 'gough[{extra}]', or in a clone: pip install -e '.[{extra}]'"
        )
    except Exception:
        number = signals.requested()
        if number is None:
            raise
        return _stopped(name, number)  # a library turned `Stopped` into another error


def _stopped(name: str, number: int) -> int:
    how = "interrupted" if number == signal.SIGINT else "terminated"
    _print_error(f"{name}: {how}; no file was changed")
    return 128 + number


def _call_command(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_help(), file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else BAD_USAGE
    command, rest = arguments[0], arguments[1:]
    if command in ("-V", "--version", "version"):
        print(f"gough {gough.__version__}")
        return 0
    if command not in COMMANDS:
        near = suggestion(command, COMMANDS)
        raise GoughError(f"no command {command!r}{near} commands are {', '.join(COMMANDS)}")
    import tyro

    module, function, _ = COMMANDS[command]
    run = getattr(import_module(module), function)
    for each in run.values() if isinstance(run, dict) else [run]:
        each.__doc__ = _laid_out(each.__doc__ or "")
    # flags are --flag alone, without a --no-flag beside it
    config = (tyro.conf.FlagCreatePairsOff,)
    if isinstance(run, dict):  # a family of commands, by name
        return tyro.extras.subcommand_cli_from_dict(
            run, prog=f"gough {command}", args=rest, config=config
        )
    return tyro.cli(run, prog=f"gough {command}", args=rest, config=config)


def _laid_out(docstring: str) -> str:
    """A docstring with paragraphs that fit a screen, and one line for each option.

    tyro wraps the options; of other paragraphs it joins all lines that begin with a letter.
    """
    text, head, options = inspect.cleandoc(docstring).partition("\nArgs:")
    paragraphs = [
        "\n".join(textwrap.wrap(paragraph, WIDTH, subsequent_indent="  "))
        for paragraph in text.split("\n\n")
    ]
    return "\n\n".join(paragraphs) + head + re.sub(r"\n {8}", " ", options)


def _help() -> str:
    lines = [f"  {name:<11} {text}" for name, (_, _, text) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: gough COMMAND [OPTIONS]",
            "",
            "Forward kinematics of hexapods: poses from the lengths of their legs, and back.",
            "",
            "commands:",
            *lines,
            "",
            "gough COMMAND --help lists the options; gough --version prints the version.",
        ]
    )


def _print_error(text: str) -> int:
    """Print one line on standard error, which may be closed, and return the exit code."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)
    return BAD_USAGE


def _drop_output() -> None:
    """Discard what is buffered for standard output, so that the exit is silent."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


if __name__ == "__main__":
    main()
