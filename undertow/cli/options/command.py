"""A command of the command line: options, help, and the function that is imported when it runs."""

import dataclasses
import importlib
import inspect
import time
from collections.abc import Callable
from typing import Any, ClassVar, get_type_hints

from undertow.cli.kept_answer import print_kept
from undertow.core.errors import BadInput
from undertow.core.option_groups import set_signature


@dataclasses.dataclass(frozen=True)
class Command:
    """A command. Its fields are its arguments and options, as typer declares them; its docstring is its help.

    The function gets the command, with what was given, and returns the exit code or None for 0. Nothing but typer is
    imported before, so that help and mistakes are answered at once.

    Attributes:
        runs: `module:function`.
        named: the word after `undertow`; "" for that of the function.
        needs: packages of the extra without which it cannot run; the module that misses one says how to install it.
        since: when the command line was read, s, of `time.perf_counter`.
    """

    runs: ClassVar[str]
    named: ClassVar[str] = ""
    needs: ClassVar[tuple[str, ...]] = ()
    since: float = dataclasses.field(init=False, default_factory=time.perf_counter)

    @classmethod
    def word(cls) -> str:
        """The word after `undertow`."""
        return cls.named or cls.runs.rpartition(":")[2]

    @classmethod
    def sentence(cls) -> str:
        """What the command does."""
        return (cls.__doc__ or "").partition("\n")[0]

    def keeps_answer(self) -> bool:
        """Whether what it prints depends on what is installed alone, so that it is kept for the next time."""
        return False

    def target(self) -> str:
        """`module:function` of what was given: that of `runs`, unless a word chooses another one."""
        return self.runs

    @classmethod
    def callback(cls) -> Callable[..., int | None]:
        """The function that typer makes a command of."""

        def run(**options: Any) -> int | None:
            command = cls(**options)
            if command.keeps_answer():
                return print_kept((cls.word(), options), lambda: imported(command))
            return imported(command)

        def imported(command: Command) -> int | None:
            module, _, function = command.target().partition(":")
            try:
                home = importlib.import_module(module)
            except ModuleNotFoundError as error:
                if error.name not in cls.needs:
                    raise
                raise BadInput("", "", str(error)) from None
            return getattr(home, function)(command)

        hints = get_type_hints(cls, include_extras=True)
        fields = [field for field in dataclasses.fields(cls) if field.init]
        run.__name__, run.__doc__ = cls.word(), cls.__doc__
        set_signature(run, inspect.Signature([_parameter(field, hints[field.name]) for field in fields]))
        return run


def _parameter(field: dataclasses.Field, annotation: Any) -> inspect.Parameter:
    missing = field.default is dataclasses.MISSING
    default = inspect.Parameter.empty if missing else field.default
    return inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
