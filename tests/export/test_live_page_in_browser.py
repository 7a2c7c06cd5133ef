"""The page in headless Chromium: it runs, a killed thruster is found, and the error stays small; on a phone, too."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from undertow.outside.browser.browser_page import export_page
from undertow.scenario.build import build
from undertow.scenario.reading import read

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[2] / "examples" / "browser.yaml"

OPTIONS = (
    "--headless --no-sandbox --no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --virtual-time-budget=9000 "
    "--enable-logging=stderr --v=0 --dump-dom"
).split()

# A visit: twenty times real time, a thruster is killed after a second, and the set-point moves forward for another.
VISIT = """
<script>
(() => {
  const live = () => document.querySelector(".live"), press = (type) => window.dispatchEvent(new KeyboardEvent(type, { key: "w" }));
  const begun = setInterval(() => {
    if (!live().querySelector("select[aria-label=speed]")) return;
    clearInterval(begun);
    live().querySelector("select[aria-label=speed]").value = "20";
    setTimeout(() => live().querySelector("button[data-fault=\'thruster 3\']").click(), 1000);
    setTimeout(() => press("keydown"), 3000);
    setTimeout(() => press("keyup"), 3100);
  }, 50);
})();
</script></body>
"""


@pytest.fixture(scope="module")
def page():
    return export_page(build(read(EXAMPLE))).files["index.html"]


@pytest.mark.parametrize("width", [1280, 420])
def test_a_killed_thruster_is_found_and_the_vehicle_held(tmp_path, page, width):
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert program, "this test needs Chromium: apt-get install -y chromium"
    (tmp_path / "index.html").write_text(page.replace("</body>", VISIT), encoding="utf-8")
    command = [program, *OPTIONS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900"]
    done = subprocess.run(
        [*command, (tmp_path / "index.html").as_uri()], capture_output=True, text=True, timeout=500, check=True
    )
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    text = done.stdout.split("<script")[0]
    assert re.search(r"Thruster 3 is dead; the supervisor found it after \d\.\d s, and the others take over", text)
    said = re.search(r"position error has stayed below 5.0 cm|Position error below 5.0 cm again, \d+\.\d s after", text)
    assert said, text[-3000:]
    facts = dict(re.findall(r'data-(time|error)="([\d.]+)"', text))
    assert float(facts["time"]) > 40 and float(facts["error"]) < 0.2
