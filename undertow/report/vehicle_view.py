"""What a notebook shows of a vehicle: what its numbers mean, and where its thrusters are."""

from undertow.physics.vehicles.facts import facts_of
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.answers.vehicle_answer import answer_of_vehicle
from undertow.report.page import Html, tag
from undertow.report.vehicle_picture import vehicle_picture
from undertow.scenario.checks.vehicle_lint import lint

_CAPTION = "Arrows point along positive thrust; a dot in a ring is thrust towards the eye, a cross thrust away from it."


def vehicle_in_notebook(vehicle: VehicleModel) -> Html:
    """The answer of a vehicle and its picture."""
    facts = facts_of(vehicle)
    if vehicle.size is not None:
        facts = facts._replace(size=vehicle.size)
    return answer_with_picture(vehicle.name, answer_of_vehicle(facts, lint(facts)), vehicle)


def answer_with_picture(title: str, answer: PlainAnswer, vehicle: VehicleModel) -> Html:
    """An answer about a vehicle above its picture."""
    return in_notebook(title, answer, tag("figure", vehicle_picture(vehicle), tag("figcaption", _CAPTION)))
