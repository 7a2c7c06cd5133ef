"""The answer of the arena: who stands first, who follows, and what nobody holds."""

from collections.abc import Iterator

from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.studies.arena.leader_board import Board, Standing
from undertow.studies.arena.scores import LOST

_FOLLOWING = 3


def answer_of_board(board: Board) -> PlainAnswer:
    """The answer of a leader board; whether it went well is for the reader to say."""
    first, *others = board.standings
    verdict = f"{first.entry.name}: {_score(first)}."
    if others:
        verdict = f"{first.entry.name} stands first of {len(board.standings)} laws, with {_score(first)}."
    lines = (*_following(others), *_unheld(board), *_losing(board))
    return PlainAnswer(None, verdict, lines)


def _score(standing: Standing) -> str:
    score = standing.score
    lost = f", {quantity(score.lost, '')} of the trials lost" if score.lost else ", no trial lost"
    return f"{score.error:.2g} tolerances of error{lost}"


def _following(others: list[Standing]) -> Iterator[str]:
    for standing in others[:_FOLLOWING]:
        yield f"{standing.entry.name} follows with {_score(standing)}."


def _unheld(board: Board) -> Iterator[str]:
    """Tasks on a vehicle that no law keeps within its tolerance."""
    unheld = [cell for cell in board.cells if all(standing.score.cells[cell].error > 1 for standing in board.standings)]
    if unheld:
        named = ", ".join(f"{task.replace('_', ' ')} on {vehicle}" for task, vehicle in unheld[:_FOLLOWING])
        more = len(unheld) - _FOLLOWING
        yield f"No law stays within the tolerance in {named}{f' and {more} more' if more > 0 else ''}."


def _losing(board: Board) -> Iterator[str]:
    """The task that loses most laws."""
    lost = {cell: sum(standing.score.cells[cell].error >= LOST for standing in board.standings) for cell in board.cells}
    (task, vehicle), laws = max(lost.items(), key=lambda pair: pair[1])
    if laws and len(board.standings) > 1:
        of = f"{laws} of {len(board.standings)} laws"
        yield f"Hardest: {task.replace('_', ' ')} on {vehicle}, which {of} {'loses' if laws == 1 else 'lose'}."
