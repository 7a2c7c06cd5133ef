"""Reading campaign files, and writing them down whole: with the scenario inside, so that a store stands alone."""

from pathlib import Path

from undertow.campaign.campaign_schema import Campaign, validate
from undertow.scenario.reading import Text, dump, parse, read


def read_campaign(path: Path) -> tuple[Campaign, Text]:
    """A campaign from its file, and the text that it stands in.

    Raises:
        BadInput: anything wrong with it.
    """
    text = read(path, "CAMPAIGN")
    return validate(text), text


def read_text(text: str, folder: Path) -> tuple[Campaign, Text]:
    """A campaign from the text of `whole`; relative paths in it start at `folder`."""
    parsed = parse(text, "", folder, "CAMPAIGN")
    return validate(parsed), parsed


def whole(campaign: Campaign, scenario: dict) -> str:
    """YAML with everything that is asked; `chunk` and free text say nothing about the results."""
    unused = set() if campaign.variants else {"variants"}
    data = campaign.model_dump(exclude_none=True, exclude={"chunk", "description"} | unused)
    return dump(data | {"scenario": scenario})
