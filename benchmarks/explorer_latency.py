"""How long `ut.explore` takes from a slider to the picture, in JupyterLab in a headless Chromium.

    python benchmarks/explorer_latency.py [--presses 40] [--picture lab.png]

It needs jupyterlab, ipykernel, playwright and Chromium (`pip install jupyterlab ipykernel playwright`), and prints
milliseconds between a press of an arrow key on a slider and the change of the picture in the page, for 20 s of the
BlueROV2 Heavy in current and waves.
"""

import argparse
import contextlib
import json
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).parents[1]
CELL = """\
import undertow as ut
ut.prepare(keep_programs=True)
import yaml
data = yaml.safe_load(open({path!r}))
data["loop"]["duration"] = 20.0
ut.explore(data, {{"disturbance[0].velocity[0]": (0.0, 1.0), "disturbance[1].height": (0.1, 1.0)}})
"""
# Milliseconds between a press of a key and the next change of the picture.
MEASURE = """
async (presses) => {
  const handle = document.querySelector('.noUi-handle'), times = [];
  for (let i = 0; i < presses; i++) {
    const picture = document.querySelector('.undertow').parentElement;
    const changed = new Promise(done => {
      const observer = new MutationObserver(() => { observer.disconnect(); requestAnimationFrame(done); });
      observer.observe(picture, {childList: true, subtree: true});
    });
    const start = performance.now();
    handle.focus();
    handle.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', keyCode: 39, bubbles: true}));
    await Promise.race([changed, new Promise((_, fail) => setTimeout(() => fail('no change'), 10000))]);
    times.push(performance.now() - start);
    await new Promise(done => setTimeout(done, 150));
  }
  return times;
}
"""


@contextlib.contextmanager
def lab(folder: Path) -> Iterator[str]:
    """JupyterLab in a folder, until it answers; its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", f"--port={port}", "--IdentityProvider.token="]
    server = subprocess.Popen([*command, "--allow-root"], cwd=folder, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        for _ in range(120):
            with contextlib.suppress(OSError), urllib.request.urlopen(f"{address}/api"):
                break
            time.sleep(0.5)
        yield address
    finally:
        server.terminate()
        server.wait()


def measured(page: Page, address: str, presses: int) -> list[float]:
    """Times of presses, ms, the first ones left out."""
    page.goto(f"{address}/lab/tree/explore.ipynb?reset")
    page.wait_for_selector(".jp-Notebook .jp-Cell", timeout=60_000)
    page.wait_for_function("document.body.innerText.includes('| Idle')", timeout=60_000)  # the kernel runs
    page.wait_for_timeout(2_000)
    page.click(".jp-Notebook .jp-Cell .jp-InputArea-editor")
    page.keyboard.press("Shift+Enter")
    page.wait_for_selector(".undertow svg", timeout=180_000)
    page.wait_for_selector(".noUi-handle")
    page.wait_for_timeout(2_000)
    return page.evaluate(MEASURE, presses + 5)[5:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presses", type=int, default=40)
    parser.add_argument("--picture", type=Path, help="also write what the browser shows")
    settings = parser.parse_args()
    cell = {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "id": "explore"}
    cell["source"] = CELL.format(path=str(ROOT / "examples" / "bluerov2_heavy.yaml"))
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    notebook = {"cells": [cell], "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        (Path(folder) / "explore.ipynb").write_text(json.dumps(notebook))
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        with lab(Path(folder)) as address:
            times = measured(page, address, settings.presses)
            if settings.picture is not None:
                page.screenshot(path=settings.picture)
        browser.close()
    print(f"slider to picture: median {statistics.median(times):.0f} ms, longest of {len(times)}: {max(times):.0f} ms")


if __name__ == "__main__":
    main()
