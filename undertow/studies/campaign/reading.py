"""Reading campaign files, and writing them down whole: with the scenario inside, so that a store stands alone."""

from pathlib import Path

from undertow.scenario.reading import dump, parse, read
from undertow.studies.campaign.schema import Campaign, validate


def read_campaign(path: Path) -> tuple[Campaign, Path]:
    """A campaign from its file, and the folder where paths in it start.

    Raises:
        BadInput: anything wrong with it.
    """
    text = read(path, "CAMPAIGN")
    return validate(text), text.folder


def read_text(text: str) -> Campaign:
    """A campaign from the text of `whole`."""
    return validate(parse(text, "campaign.yaml", Path(), "CAMPAIGN"))


def whole(campaign: Campaign, scenario: dict) -> str:
    """YAML with everything that decides about the results; `chunk` and free text do not."""
    data = campaign.model_dump(exclude_none=True, exclude={"chunk", "description"})
    return dump(data | {"scenario": scenario})
