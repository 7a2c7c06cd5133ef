"""A law that is not told of its actuators' limits."""

from typing import Any

from undertow.core.contracts import (
    AbstractController,
    AbstractInformedController,
    Measurement,
    Model,
    Target,
    known_acceleration,
)


class CommandFed(AbstractInformedController):
    """The same law, but it learns from what it commanded instead of from what was applied."""

    law: AbstractController
    model: Model

    def __init__(self, law: AbstractController):
        self.law, self.model = law, law.model

    def init(self, y: Measurement, r: Target) -> Any:
        return self.law.init(y, r)

    def command(self, z: Any, y: Measurement, r: Target):
        return self.law.command(z, y, r)

    def signals(self):
        return self.law.signals()

    def advance(self, z: Any, y: Measurement, r: Target, u_applied, dt) -> Any:
        commanded, _ = self.law.command(z, y, r)
        return self.law.advance(z, y, r, commanded, dt)

    def known_acceleration(self, z: Any, y: Measurement, u_applied):
        return known_acceleration(self.law, z, y, u_applied)
