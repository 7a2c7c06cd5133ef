"""Errors of parts that users wrote, as a sentence with the method and the line of their file."""

import inspect
import re
import traceback
from dataclasses import FrozenInstanceError
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

from undertow.core.errors import nearest

MODULE_PREFIX = "undertow_part_"  # of the modules that users' files become

# What the code of a user may raise and end with: `sys.exit` as well, but not Ctrl-C.
RAISED = (Exception, SystemExit, GeneratorExit)

_ABSTRACT = re.compile(r"Can't instantiate abstract class (\w+).* abstract (method|attribute)s? (.+)")
_ASSIGNED = re.compile(r"cannot assign to field '(\w+)'")
# Arithmetic with a Measurement or a Target, whole or in slices.
_OF_TUPLES = re.compile(r"(unsupported operand.*'(tuple|Measurement|Target)')|(arguments?, got .*(Measurement|Target))")
_LONGEST = 110  # characters of Python's message

# Name of JAX's error, its cause and the remedy; the first that applies. By name, so that JAX need not be imported.
_REFUSED: tuple[tuple[str, str, str], ...] = (
    (
        "TracerBoolConversionError",
        "Python's `if`, `while`, `and`, `or`, `not`, `min` or `max` needs the value of a traced array",
        "Use `jnp.where(condition, a, b)`, `jnp.minimum` or `jnp.maximum`",
    ),
    ("TracerArrayConversionError", "NumPy needs the value of a traced array", "Use `jax.numpy`"),
    ("TracerIntegerConversionError", "a traced array is used as an index or a length", "Use `jnp.take`"),
    (
        "ConcretizationTypeError",
        "`float`, `int`, `math` or a shape needs the value of a traced array",
        "Keep the array, and use `jax.numpy`",
    ),
)


class UserCodeFailure(NamedTuple):
    """What failed and why, with its location in the user's file; and the remedy, "" where none is known."""

    says: str
    hint: str


def fault_of(error: BaseException) -> UserCodeFailure:
    """The cause of an exception in a part: `cannot run `Mine.command`: NumPy needs ... (mine.py, line 7)`."""
    if isinstance(error, SyntaxError):
        return UserCodeFailure(
            f"{type(error).__name__}: {error.msg} ({Path(error.filename or '').name}, line {error.lineno})", ""
        )
    text = said_by(error)
    frames = [(f, line) for f, line in traceback.walk_tb(error.__traceback__) if _is_own(f.f_globals.get("__name__"))]
    if abstract := _ABSTRACT.match(text):
        return _abstract(abstract, frames)
    why, hint = _reason(error, text)
    if not frames:
        return UserCodeFailure(why, hint)
    (frame, line), method = frames[-1], frames[-1][0].f_code.co_qualname.partition(".<locals>")[0]
    doing = "" if method == "<module>" else f"cannot run `{method}`: "
    return UserCodeFailure(f"{doing}{why} ({Path(frame.f_code.co_filename).name}, line {line})", hint)


def python_says(error: BaseException) -> str:
    """Cause and remedy in one line."""
    message, hint = fault_of(error)
    return f"{message}. {hint}" if hint else message


def said_by(error: BaseException) -> str:
    """The message of an exception in one line; that it has none where the class of a user's own fails to give it."""
    try:
        return " ".join(str(error).split())
    except RAISED:
        return "its message cannot be read"


def place_of(part: Any, method: str = "") -> str:
    """`mine.py, line 7`, where a class or function of the user's own begins, or a method; "" for other people's.

    Without the line for a class that no statement of the file defines.

    Args:
        part: an object, or the class, or a function.
        method: its name; "" for the class itself.
    """
    kind = part if inspect.isclass(part) or inspect.isfunction(part) else type(part)
    thing: Any = inspect.unwrap(getattr(kind, method, None) or str) if method else kind
    if not _is_own(getattr(thing, "__module__", None)):
        return ""
    try:
        return f"{Path(inspect.getsourcefile(thing) or '').name}, line {inspect.getsourcelines(thing)[1]}"
    except (OSError, TypeError, IndexError):  # made by `type`, or the file is another by now
        return f"{thing.__module__.removeprefix(MODULE_PREFIX)}.py"


def _is_own(module: str | None) -> bool:
    return (module or "").startswith(MODULE_PREFIX)


def _reason(error: BaseException, text: str) -> tuple[str, str]:
    """Cause and remedy."""
    classes = {kind.__name__ for kind in type(error).__mro__ if kind.__module__.partition(".")[0] == "jax"}
    for name, why, hint in _REFUSED:
        if name in classes:
            return why, hint
    if isinstance(error, FrozenInstanceError) and (assigned := _ASSIGNED.match(text)):
        why = f"it assigns `self.{assigned[1]}`, but a part holds parameters only"
        return why, "Keep what changes in the state: it goes in as an argument and comes out as a result"
    if isinstance(error, ModuleNotFoundError) and error.name:
        hint = f"Install `{error.name}` beside undertow; if it is a file of yours, add its folder to PYTHONPATH"
        return f"{type(error).__name__}: {text}", hint
    shortened = text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
    return f"{type(error).__name__}: {shortened}", _meant(error, text)


def _meant(error: BaseException, text: str) -> str:
    """What was meant by an attribute that an object lacks, or by arithmetic with a tuple; "" where that is unknown."""
    if isinstance(error, AttributeError) and error.name and error.obj is not None:
        inner = [attribute for attribute in dir(error.obj) if not attribute.startswith("_")]
        if outer := next(
            (attribute for attribute in inner if hasattr(getattr(error.obj, attribute, None), error.name)), ""
        ):
            return f"Did you mean `.{outer}.{error.name}`?"
        return nearest(error.name, inner)
    if isinstance(error, TypeError) and _OF_TUPLES.search(text):
        return (
            "`y` and `r` are tuples of arrays: use `y.position` and `y.velocity`, and `r.position`, `r.velocity` and "
            "`r.acceleration`"
        )
    return ""


def _abstract(match: re.Match[str], frames: list[tuple[FrameType, int]]) -> UserCodeFailure:
    """A class that lacks methods or attributes of its contract."""
    name, member_kind, lacking = match.groups()
    names = re.findall(r"\w+", lacking)
    listed = " and ".join(f"`{member}`" for member in names)
    many, verb = ("s", "are") if len(names) > 1 else ("", "is")
    missing = "implemented" if member_kind == "method" else "declared"
    kind = next((f.f_globals[name] for f, _ in reversed(frames) if isinstance(f.f_globals.get(name), type)), None)
    location = place_of(kind) if kind is not None else ""
    at = f" ({location})" if location else ""
    return UserCodeFailure(f"cannot instantiate `{name}`: {member_kind}{many} {listed} {verb} not {missing}{at}", "")
