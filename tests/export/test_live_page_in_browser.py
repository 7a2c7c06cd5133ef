"""The page in headless Chromium: it runs, a killed thruster is found, and the error stays small; on a phone, too."""

import re
import shutil

import pytest
from playwright.sync_api import sync_playwright

from undertow.outside.browser.browser_page import export_page
from undertow.scenario.reading import read
from undertow.studies.comparison.candidates import built_with_each

pytestmark = pytest.mark.slow

OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE = 300_000  # ms, on a machine that does other things


@pytest.fixture(scope="module")
def address(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    scenario = read(request.config.rootpath / "examples" / "browser.yaml")
    export_page(built_with_each(["robust", "pid"], scenario, None)).write(folder, option="--wasm")
    return (folder / "index.html").as_uri()


@pytest.fixture(scope="module")
def browser():
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert program, "this test needs Chromium: apt-get install -y chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=OPTIONS)
        yield browser
        browser.close()


def until(page, condition):
    """Wait until a condition on what the page says of itself, in JavaScript, holds; return its time and error."""
    facts = "document.querySelector('.live').dataset"
    page.wait_for_function(f"(({{time, error}}) => {condition})({facts})", timeout=PATIENCE)
    return page.evaluate(f"[Number({facts}.time), Number({facts}.error)]")


@pytest.mark.parametrize("width", [1280, 420])
def test_a_killed_thruster_is_found_and_the_vehicle_held(address, browser, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    complaints = []
    # What a driver of a graphics card says of its speed is none of the page's.
    page.on("console", lambda message: complaints.append(message.text) if "GPU stall" not in message.text else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(address)
    until(page, "time > 0")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.select_option("select[aria-label=speed]", "most")
    until(page, "time > 15")
    page.click("button[data-fault='thruster 3']")
    happening = page.locator(".happening")
    until(page, "document.querySelector('.happening').innerText.includes('osition error')")
    said = happening.inner_text()
    assert re.search(r"Thruster 3 is dead; the supervisor found it after \d\.\d s, and the others take over", said)
    assert re.search(r"position error has stayed below 5\.0 cm|Position error below 5\.0 cm again", said)
    assert page.locator("button[data-fault='thruster 3']").is_disabled()
    later, _ = until(page, "time > 40")
    page.keyboard.down("w")
    _, error = until(page, f"time > {later + 2}")
    page.keyboard.up("w")
    assert 0 < error < 1
    page.select_option("select[aria-label=speed]", "1")
    page.get_by_role("button", name="Reset").click()
    until(page, "time < 15")
    assert "Everything works" in happening.inner_text()
    page.close()
    assert complaints == []


def test_another_controller_begins_again_in_the_same_sea(address, browser):
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    complaints = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(address)
    until(page, "time > 0")
    waves = page.get_by_label("wave height")
    waves.fill("0")
    page.select_option("select[aria-label=speed]", "most")
    until(page, "time > 20")
    assert page.get_by_label("bandwidth of the controller").is_visible()
    page.select_option("select[aria-label=speed]", "1")
    page.select_option("select[aria-label=controller]", "1")
    until(page, "time < 15")
    assert waves.input_value() == "0"
    assert "The controller is pid" in page.locator(".happening").inner_text()
    assert page.get_by_label("frequency of the controller").is_visible()
    page.select_option("select[aria-label=speed]", "most")
    _, calm = until(page, "time > 30")
    waves.fill("8")
    until(page, "time > 45")
    page.close()
    assert complaints == []
    assert calm < 0.05
