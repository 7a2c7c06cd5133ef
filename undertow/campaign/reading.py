"""Read a campaign file, and write it as one self-contained text with the scenario inside."""

from pathlib import Path

from undertow.campaign.campaign_schema import Campaign, validate
from undertow.scenario.reading import Text, dump, parse, read


def read_campaign(path: Path) -> tuple[Campaign, Text]:
    """A campaign from its file, and the text of the file.

    Raises:
        BadInput: the file is not a valid campaign.
    """
    text = read(path, "CAMPAIGN")
    return validate(text), text


def read_text(text: str, folder: Path) -> tuple[Campaign, Text]:
    """A campaign from the text of `whole`; relative paths in it start at `folder`."""
    parsed = parse(text, "", folder, "CAMPAIGN")
    return validate(parsed), parsed


def whole(campaign: Campaign, scenario: dict) -> str:
    """The complete campaign as YAML, without `chunk` and free text, which do not affect the results."""
    unused = set() if campaign.variants else {"variants"}
    data = campaign.model_dump(exclude_none=True, exclude={"chunk", "description"} | unused)
    return dump(data | {"scenario": scenario})
