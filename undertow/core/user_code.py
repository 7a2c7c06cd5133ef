"""What Python says about a part that somebody else wrote, and where in their file."""

import re
import traceback
from pathlib import Path

MODULE_PREFIX = "undertow_part_"  # of the modules that files of the user's own become

_LACKING = re.compile(r"Can't instantiate abstract class (\w+).* abstract (?:method|attribute)s? (.+)")
_LONGEST = 110


def python_says(error: BaseException) -> str:
    """One line: `TypeError: what it says, my_rov.py line 7`, the last line of the user's own that was running."""
    if isinstance(error, SyntaxError):
        return f"{type(error).__name__}: {error.msg}, line {error.lineno}"
    text = " ".join(str(error).split())
    lacking = _LACKING.match(text)
    if lacking:
        return f"{lacking[1]} without {re.sub(r'''[{}']''', '', lacking[2])}"
    frames = traceback.walk_tb(error.__traceback__)
    own = [(f.f_code, line) for f, line in frames if f.f_globals.get("__name__", "").startswith(MODULE_PREFIX)]
    place = f", {Path(own[-1][0].co_filename).name} line {own[-1][1]}" if own else ""
    shown = text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
    return f"{type(error).__name__}: {shown}{place}"
