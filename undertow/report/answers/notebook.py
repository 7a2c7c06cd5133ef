"""An answer with its picture, as a notebook shows it."""

from undertow.report.answers.plain_answer import PlainAnswer, answer_block
from undertow.report.formats import prose
from undertow.report.page import Html, tag

# A notebook has a style sheet of its own.
_LOOKS = (
    ".undertow .answer { border-left: 6px solid #777; padding: 0.2em 1em; margin: 0.6em 0; } "
    ".undertow .holds { border-color: #2f7d4f; } .undertow .fails { border-color: #b3402a; } "
    ".undertow img { width: 100%; max-width: 60em; background: white; } .undertow figure { margin: 0; }"
)


def in_notebook(title: str, answer: PlainAnswer, *pictures: Html) -> Html:
    """What a notebook shows of a run or a study.

    Args:
        title: of it.
        answer: of it.
        pictures: one, or none where nothing can be shown.
    """
    return tag(
        "div",
        tag("style", Html(_LOOKS)),
        tag("strong", prose(title)),
        answer_block(answer),
        *pictures,
        class_="undertow",
    )
