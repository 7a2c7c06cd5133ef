"""How fast the page of `undertow export --wasm` runs in a headless Chromium, and how many pictures a second it shows.

    python benchmarks/browser_speed.py [--scenario FILE] [--slowdown 4] [--pictures FOLDER]

It needs playwright and Chromium (`pip install playwright`) and prints, at 1280 and at 420 pixels, the speed of the loop
alone and that of the whole page in multiples of real time, pictures a second, and when a killed thruster was found.
Without a graphics card Chromium renders by software, on the same processor. `--slowdown` makes the processor slower
by a factor, for an idea of a phone.
"""

import argparse
import shutil
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, sync_playwright

import undertow as ut
from undertow.outside.browser.browser_page import export_page
from undertow.scenario.build import build
from undertow.scenario.reading import read

ROOT = Path(__file__).parents[1]
OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
SIZES = ((1280, 900), (420, 860))
SETTLED = 3_000  # ms


def facts_of(page: Page, speed: str, wait: int) -> dict[str, Any]:
    """What the page says of itself after some time, ms, at a speed."""
    page.select_option("select[aria-label=speed]", speed)
    page.wait_for_timeout(wait)
    return page.evaluate("({...document.querySelector('.live').dataset})")


def visit(page: Page, address: str, slowdown: float) -> None:
    """Print what a visit at the present size shows."""
    page.goto(address)
    page.wait_for_function("document.querySelector('.live').dataset.time > 0", timeout=60_000)
    session = page.context.new_cdp_session(page)
    session.send("Emulation.setCPUThrottlingRate", {"rate": slowdown})
    fastest = facts_of(page, "most", 3 * SETTLED)
    page.click("button[data-fault='thruster 3']")
    facts_of(page, "5", 2 * SETTLED)
    steady = facts_of(page, "1", SETTLED)
    print(f"  loop alone: {fastest['most']} times real time; page as fast as it goes: {fastest['factor']} times")
    print(f"  at real time: {steady['factor']} times real time, {steady['frames']} pictures a second")
    print("  " + page.inner_text(".happening").replace("\n", "\n  "))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", type=Path, default=ROOT / "examples" / "browser.yaml")
    parser.add_argument("--slowdown", type=float, default=1.0)
    parser.add_argument("--pictures", type=Path, help="also write what the browser shows")
    settings = parser.parse_args()
    ut.prepare()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        built_by_law = {"controller of the scenario": build(read(settings.scenario))}
        export_page(built_by_law).write(Path(folder), option="--wasm")
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=OPTIONS)
        for width, height in SIZES:
            page = browser.new_page(viewport={"width": width, "height": height})
            print(f"{width} px")
            visit(page, (Path(folder) / "index.html").as_uri(), settings.slowdown)
            if settings.pictures is not None:
                page.screenshot(path=settings.pictures / f"browser-{width}.png", full_page=True)
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
