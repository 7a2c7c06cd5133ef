"""Exit codes, and one line on stderr for an error."""

import contextlib
import os
import select
import signal
import sys
import traceback
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from undertow.cli.interruptible import BY_SIGNAL, interrupted_by, raise_if_interrupted
from undertow.core.errors import BadInput, printable
from undertow.core.user_code import python_says

DONE = 0
RUN_FAILED = 1
BAD_INPUT = 2
INTERNAL_ERROR = 3
FILES_FAILED = 4
INTERRUPTED = 130  # by Ctrl-C; other signals have other codes
NOBODY_READS = BY_SIGNAL + signal.SIGPIPE

# What Python code of a user may end with, beside exceptions.
_OF_PLUG_INS = (SystemExit, GeneratorExit)

# Exit code -> when a command ends with it, for the documentation.
MEANINGS = {
    DONE: "Done.",
    RUN_FAILED: "Done, but a run failed or was not reproduced; the files are there.",
    BAD_INPUT: "Bad input, explained in one line, nothing written; or `check` found errors.",
    INTERNAL_ERROR: "Internal error: please report it, with the output of `undertow --traceback ...`.",
    FILES_FAILED: "Files could not be read or written.",
    INTERRUPTED: "Interrupted by Ctrl-C.",
    NOBODY_READS: "Nobody reads the output any more, as after `undertow list | head -3`; nothing is said.",
    BY_SIGNAL
    + signal.SIGTERM: "Ended by SIGTERM, for example by `kill` or the end of a SLURM job; otherwise like Ctrl-C.",
    BY_SIGNAL + signal.SIGHUP: "Ended by SIGHUP: the terminal or the ssh connection is gone; otherwise like Ctrl-C.",
    BY_SIGNAL + signal.SIGQUIT: "Ended by SIGQUIT, as by Ctrl-\\; otherwise like Ctrl-C.",
}


def run_guarded(command: Any, arguments: Sequence[str], program: str = "undertow") -> int:
    """Run a command of a program and return its exit code; any exception becomes one line on stderr."""
    try:
        code = command.main(args=list(arguments), prog_name=program, standalone_mode=False) or DONE
        raise_if_interrupted()
        return BY_SIGNAL + interrupted_by() if code == INTERRUPTED else code  # as typer makes of KeyboardInterrupt
    except KeyboardInterrupt:
        return BY_SIGNAL + interrupted_by()
    except (Exception, *_OF_PLUG_INS) as error:
        # Typer makes SystemExit of it.
        if isinstance(error.__context__, BrokenPipeError) and _nobody_reads():
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what Python writes as it ends
            return NOBODY_READS
        if os.environ.get("UNDERTOW_TRACEBACK") and not isinstance(error, typer.TyperException):
            traceback.print_exc()
        code, sentence = _explain(error)
        complain(sentence)
        return code


def _nobody_reads() -> bool:
    """Whether the reader of stdout has ended."""
    try:
        stdout = sys.stdout.fileno()
    except OSError:  # no file
        return False
    poll = select.poll()
    poll.register(stdout, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


def report(line: str) -> None:
    """Print a line of a command that controls a vehicle: where that fails, as on a full disk, it is lost."""
    with contextlib.suppress(OSError, ValueError):
        print(line, flush=True)


def complain(sentence: str) -> None:
    """Print an error on one line of stderr."""
    print("Error: " + printable(sentence), file=sys.stderr)


def warn_of(sentences: Iterable[str]) -> None:
    """Print warnings, one line each; the command continues."""
    for sentence in sentences:
        print("Warning: " + printable(sentence), file=sys.stderr)


def _explain(error: BaseException) -> tuple[int, str]:
    if isinstance(error, typer.TyperException):
        sentence = getattr(error, "format_message", error.__str__)().rstrip(".")
        context = getattr(error, "ctx", None)
        path = context.command_path if context is not None else "undertow"
        return BAD_INPUT, f"{sentence}{'' if sentence.endswith('?') else '.'} See `{path} --help`"
    if isinstance(error, BadInput):
        return BAD_INPUT, str(error)
    if isinstance(error, _OF_PLUG_INS):
        return BAD_INPUT, f"the command was ended by Python code that it runs: {python_says(error)}"
    if isinstance(error, OSError):
        at = f" ({error.filename})" if error.filename else ""
        return FILES_FAILED, f"files could not be read or written: {error.strerror or error}{at}"
    hint = "To see the traceback, run `undertow --traceback ...` or set UNDERTOW_TRACEBACK=1"
    return INTERNAL_ERROR, f"internal error, {type(error).__name__}: {str(error).rstrip('.')}. {hint}"
