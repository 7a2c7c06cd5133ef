"""The ablations one by one, and what stands of them in results.json."""

import importlib
import pkgutil
from types import ModuleType
from typing import Any

from undertow.reproduction import ablations
from undertow.reproduction.ablations.runner import run
from undertow.reproduction.ablations.summary import Summary, summary

SEEDS, QUICK_SEEDS = 30, 8


def modules() -> list[ModuleType]:
    """One per ablation, in order."""
    names = sorted(info.name for info in pkgutil.iter_modules(ablations.__path__))
    return [importlib.import_module(f"{ablations.__name__}.{name}") for name in names if _is_ablation(name)]


def is_long(module: ModuleType) -> bool:
    """Whether a quick look leaves it out: it takes long, or a claim of the audit tells as much."""
    return getattr(module, "LONG", False)


def one(module: ModuleType, quick: bool) -> dict[str, Any]:
    """One ablation as it stands in results.json."""
    seeds = QUICK_SEEDS if quick else SEEDS
    variants = module.variants(quick)
    summaries: dict[str, Summary] = {}
    for variant in variants:
        summaries[variant.name] = summary(run(variant.loop, variant.schedule, seeds), module.METRICS)
    said = module.judge(summaries)
    return {
        "id": identity(module),
        "question": module.QUESTION,
        "prediction": module.PREDICTION,
        "agrees": said.agrees,
        "answer": said.text,
        "left_out": getattr(module, "LEFT_OUT", ""),
        "variants": [
            {"name": variant.name, "settings": variant.settings, **summaries[variant.name].plain()}
            for variant in variants
        ],
    }


def identity(module: ModuleType) -> str:
    """A1 to A21, from the name of its file."""
    return f"A{int(module.__name__.rsplit('.', 1)[1][1:3])}"


def _is_ablation(name: str) -> bool:
    return name[0] == "a" and name[1:3].isdigit()
