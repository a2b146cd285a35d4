"""The command line: find the command, parse its options, print errors as one line."""

from __future__ import annotations

import gc
import io
import logging
import os
import signal
import sys
from collections.abc import Callable
from contextlib import nullcontext, suppress
from importlib import import_module
from types import NoneType, UnionType
from typing import Any, get_args, get_origin

import gough
from gough import compiling
from gough.commands import COMMANDS, help_text, signals
from gough.errors import GoughError, printable, suggestion

BAD_USAGE, BROKEN_PIPE = 2, 141
# Commands that mostly load modules: looking for garbage meanwhile would be a tenth of their time.
BRIEF = ("solve", "inverse", "modes", "check", "platforms")
Functions = Callable[..., int] | dict[str, Callable[..., int]]  # dict: a family of commands
EXTRAS = {
    "matplotlib": "plot",
    "viser": "view",
    "python_calamine": "excel",
    "ray": "cluster",
} | dict.fromkeys(
    ("torch", "roma", "safetensors", "onnx", "onnxscript", "scipy", "tensorboard"), "learn"
)


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit.

    Exit codes: 0 all rows have a usable result; 1 some have not; 2 bad usage, unreadable input
    or unwritable output; 130 Ctrl-C; 141 the reader of a pipe is gone; 143 asked to terminate.
    """
    given = sys.argv[1:] if arguments is None else arguments
    _prepare_streams()
    log, notes = logging.getLogger("gough"), logging.StreamHandler()  # what readers recognised
    notes.setFormatter(_Printable())
    log.addHandler(notes)
    signals.listen()
    try:
        with compiling.announced(_print_compiling) if sys.stderr.isatty() else nullcontext():
            code = _run(given)
        signals.ignore()
        try:
            sys.stdout.flush()
        except OSError:  # printed already
            _drop_output()
    finally:  # a mistake in the options ends here too
        log.removeHandler(notes)
    sys.exit(code)


def _print_compiling(name: str) -> None:
    print(f"compiling {name} for this processor, once ...", file=sys.stderr, flush=True)


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
        return _stopped(name, stop.number, stop.left)
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
        return _stopped(
            name, number, signals.Stopped.left
        )  # a library turned `Stopped` into another error


def _stopped(name: str, number: int, left: str) -> int:
    how = "interrupted" if number == signal.SIGINT else "terminated"
    _print_error(f"{name}: {how}; {left}")
    return 128 + number


def _call_command(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(help_text.overview(), file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else BAD_USAGE
    command, rest = arguments[0], arguments[1:]
    if command in ("-V", "--version", "version"):
        print(f"gough {gough.__version__}")
        return 0
    if command == "--print-completion":
        from gough.commands.completion import print_completion

        print_completion(rest, {name: _functions(name) for name in COMMANDS})
    if command not in COMMANDS:
        near = suggestion(command, COMMANDS)
        raise GoughError(f"no command {command!r}{near} commands are {', '.join(COMMANDS)}")
    if command in BRIEF:
        gc.set_threshold(100_000)
    wants_help = "-h" in rest or "--help" in rest
    with help_text.tidied() if wants_help else nullcontext():
        return _parse(f"gough {command}", _functions(command), rest)


def _functions(command: str) -> Functions:
    """The function of a command, or those of a family by name, with docstrings laid out."""
    module, name, _ = COMMANDS[command]
    found = getattr(import_module(module), name)
    for each in found.values() if isinstance(found, dict) else [found]:
        each.__doc__ = help_text.laid_out(each.__doc__ or "")
    return found


def _parse(program: str, functions: Functions, arguments: list[str]) -> int:
    """Parse the arguments of a command and call its function."""
    import tyro

    _skip_typeguard()
    # flags are --flag alone, without a --no-flag beside it
    config = (tyro.conf.FlagCreatePairsOff,)
    if isinstance(functions, dict):
        return tyro.extras.subcommand_cli_from_dict(
            functions, prog=program, args=arguments, config=config
        )
    return tyro.cli(functions, prog=program, args=arguments, config=config)


def _skip_typeguard() -> None:
    """Let tyro check defaults of None and () itself: importing typeguard takes 0.1 s."""
    with suppress(ImportError, AttributeError):  # another version of tyro does it its own way
        from tyro import _resolver

        thorough = _resolver.is_instance

        def is_instance(kind: Any, value: Any) -> bool:
            if get_origin(kind) is UnionType and value is None:
                return NoneType in get_args(kind)
            if value == () and get_args(kind)[1:] == (...,):
                return get_origin(kind) is tuple
            return thorough(kind, value)

        _resolver.is_instance = is_instance


def _print_error(text: str) -> int:
    """Print one line on standard error, which may be closed, and return the exit code."""
    with suppress(OSError):
        print(printable(text), file=sys.stderr, flush=True)
    return BAD_USAGE


class _Printable(logging.Formatter):
    """Notes without control characters."""

    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record))


def _prepare_streams() -> None:
    """Make standard streams usable that are closed, or whose encoding lacks characters."""
    for name, flags, mode in (
        ("stdin", os.O_RDONLY, "r"),
        ("stdout", os.O_RDONLY, "w"),  # so that writing to it is an error
        ("stderr", os.O_WRONLY, "w"),
    ):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, flags), mode))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _drop_output() -> None:
    """Discard what is buffered for standard output, so that the exit is silent."""
    null = os.open(os.devnull, os.O_WRONLY)
    with suppress(OSError):  # a stream without a file
        os.dup2(null, sys.stdout.fileno())
    os.close(null)


if __name__ == "__main__":
    main()
