"""The replay in headless Chromium: it shows something, nothing is complained of, nothing is loaded."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from matplotlib import image

from undertow.report.page import document
from undertow.report.replay.replay_section import replay_looks, replay_section

OPTIONS = (
    "--headless --no-sandbox --no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars --virtual-time-budget=4000 "
    "--enable-logging=stderr --v=0"
).split()


def browse(page, folder, *options):
    """Standard output, and what the page said on the console."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert program, "this test needs Chromium: apt-get install -y chromium"
    command = [program, *OPTIONS, f"--user-data-dir={folder / 'profile'}", *options, page.as_uri() + "#t=60"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def share_near(pixels, colour, within=60):
    """Share of the pixels whose colour is near a given one."""
    away = np.abs(pixels[..., :3].astype(int) - [int(colour[i : i + 2], 16) for i in (1, 3, 5)]).sum(-1)
    return (away < within).mean()


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 500])
def test_replay_of_two_vehicles_is_shown(two_minutes, tmp_path, width):
    other = two_minutes._replace(
        label="two", series=two_minutes.series | {"position": two_minutes.series["position"] + 0.4}
    )
    page = tmp_path / "run.html"
    page.write_text(document("two", replay_section([two_minutes, other]), looks=replay_looks()), encoding="utf-8")
    _, complaints = browse(page, tmp_path, f"--screenshot={tmp_path / 'shot.png'}", f"--window-size={width},900")
    assert complaints == []
    view = (image.imread(tmp_path / "shot.png")[120:480, 30 : min(width, 800) - 30] * 255).round()
    assert share_near(view, "#0072b2") > 2e-4 and share_near(view, "#e07b00") > 2e-4  # the paths of both
    assert share_near(view, "#f6f9fb", 12) > 0.05  # the water around them
    text, complaints = browse(page, tmp_path, "--dump-dom")
    assert complaints == [] and re.search(r'data-first-frame="\d+"', text)
    assert "60.00 s of 120 s" in text and "T1 fore starboard" not in text.split("<script")[0]
    rows = re.findall(r"<tr><td>(one|two)</td><td>(.*?)</td><td>(.*?)</td><td>", text)
    assert [label for label, *_ in rows] == ["one", "two"]
    for _, *errors in rows:
        assert [float(one) for one in errors] == pytest.approx(two_minutes.series["error"][1200], abs=6e-3)
