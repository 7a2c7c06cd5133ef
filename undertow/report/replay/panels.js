// Flat pictures: names in the view, bars beside it, and numbers.

const RAISED = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"; // digits of powers of ten
const LEAST_FOR_NAMES = 80; // px; names of thrusters would cover each other on a smaller vehicle

function clearCanvas(canvas, width, height) {
  const dots = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * dots) || canvas.height !== Math.round(height * dots)) {
    canvas.width = Math.round(width * dots);
    canvas.height = Math.round(height * dots);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  pen.textBaseline = "middle";
  return pen;
}

// Places of a label beside its point, px: the first that is free is taken, and kept while it stays free.
const PLACES = [[6, 0], [6, -14], [6, 14], [-6, 0], [-6, -14], [-6, 14], [6, -28], [6, 28], [-6, -28], [-6, 28], [6, -42], [6, 42]];

// `at` gives the components of a series of the run whose details are shown.
function paintNames(page, scene, runs, at) {
  const width = page.view.clientWidth, height = page.view.clientHeight;
  const pen = clearCanvas(page.overlay, width, height);
  const taken = []; // boxes: left, top, right, bottom
  const seenAt = (point) => {
    const seen = point.clone().project(scene.camera);
    return seen.z > 1 ? null : [((seen.x + 1) * width) / 2, ((1 - seen.y) * height) / 2];
  };
  const write = (key, text, point, colour) => {
    const seen = seenAt(point);
    if (!seen) return;
    const long = pen.measureText(text).width;
    const boxAt = ([right, down]) => {
      const left = seen[0] + (right < 0 ? right - long : right);
      return [left, seen[1] + down - 7, left + long, seen[1] + down + 7];
    };
    const free = (place) => taken.every((one) => apart(boxAt(place), one));
    const before = page.places.get(key);
    const place = (before && free(before) && before) || PLACES.find(free) || PLACES[0];
    const box = boxAt(place);
    page.places.set(key, place);
    taken.push(box);
    pen.lineWidth = 3;
    pen.strokeStyle = "rgba(255,255,255,0.85)";
    pen.strokeText(text, box[0], box[1] + 7);
    pen.fillStyle = colour;
    pen.fillText(text, box[0], box[1] + 7);
  };
  const within = (object, point) => object.localToWorld(point);
  for (const { water, uncertainty, estimate } of scene.vehicles) {
    for (const arrow of [water, uncertainty, estimate]) if (arrow.visible) taken.push(...alongArrow(arrow, seenAt));
  }
  scene.vehicles.forEach((vehicle, i) => {
    const over = within(vehicle.body, new THREE.Vector3(0, 0, -0.8 * vehicle.run.size[2]));
    if (runs.length > 1) write(`run ${i}`, vehicle.run.label, over, vehicle.run.colour);
  });
  if (page.labels.checked) {
    const vehicle = scene.vehicles[Number(page.which.value)], { run } = vehicle; // several vehicles often coincide
    if (vehicle.water.visible) {
      const speed = Math.hypot(...at("water"));
      const tail = within(scene.world, vehicle.water.position.clone());
      write("water", `water ${speed.toFixed(2)} m/s`, tail, COLOUR.water);
    }
    if (sizeInView(scene, vehicle, width) >= LEAST_FOR_NAMES) {
      run.thrusters.forEach((thruster, j) => {
        const name = thruster.name.split(" ")[0];
        write(`thruster ${j}`, name, within(vehicle.body, vector(thruster.position)), COLOUR.ink);
      });
    }
  }
  paintCompass(pen, scene.camera, height);
  pen.fillStyle = "#555555";
  pen.textAlign = "right";
  pen.fillText(`grid ${Number(scene.step.toPrecision(3))} m`, width - 8, height - 12);
  pen.textAlign = "left";
}

function apart(one, other) {
  return one[2] < other[0] || other[2] < one[0] || one[3] < other[1] || other[3] < one[1];
}

// Small boxes along an arrow in the view, which labels keep clear of.
function alongArrow(arrow, seenAt) {
  const length = arrow.head.position.y + arrow.head.scale.y / 2;
  const places = Array.from({ length: 12 }, (_, i) => seenAt(arrow.localToWorld(new THREE.Vector3(0, (i / 11) * length, 0))));
  return places.filter(Boolean).map(([x, y]) => [x - 5, y - 5, x + 5, y + 5]);
}

// Length of a vehicle in the view, px.
function sizeInView(scene, vehicle, width) {
  const { camera } = scene, away = camera.position.distanceTo(screenPoint(vehicle.body.position.toArray()));
  return (width * vehicle.run.longest) / (2 * away * Math.tan((camera.fov * Math.PI) / 360) * camera.aspect);
}

// Directions of north, east and down as the camera sees them.
function paintCompass(pen, camera, height) {
  const turn = camera.quaternion.clone().invert(), [x, y, length] = [38, height - 38, 26];
  [["N", [1, 0, 0], "#c1121f"], ["E", [0, 1, 0], "#2f7d4f"], ["D", [0, 0, 1], "#0072b2"]].forEach(([name, axis, colour]) => {
    const seen = screenPoint(axis).applyQuaternion(turn);
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + length * seen.x, y - length * seen.y);
    pen.stroke();
    pen.fillText(name, x + (length + 8) * seen.x - 4, y - (length + 8) * seen.y);
  });
}

// A panel: a heading with the scale, and rows of bars. `paint` gets the pen, the run, its width and `at`, which
// gives the components of a series.
function makePanel(page, title, rows, rowHeight, paint) {
  const heading = element("h3", {}, title), canvas = element("canvas", { class: "bars" });
  page.panels.append(heading, canvas);
  return (run, at) => {
    const count = rows(run), width = canvas.clientWidth, height = Math.max(count * rowHeight, 1);
    heading.hidden = canvas.hidden = !count;
    if (!count) return;
    canvas.style.height = `${height}px`;
    paint(clearCanvas(canvas, width, height), run, width, at);
  };
}

const NUMBERS = 72; // px, column of numbers

// Width of the column of names, px: that of the longest name of a thruster or an axis, but no more than half.
function namesWidth(pen, run, width) {
  const names = [...run.thrusters.map((thruster) => thruster.name), ...run.axes];
  return Math.min(Math.max(...names.map((name) => pen.measureText(name).width)) + 12, width / 2);
}

function paintRow(pen, names, width, top, height, name, number) {
  const middle = (names + width - NUMBERS) / 2;
  pen.fillStyle = COLOUR.ink;
  pen.fillText(name, 0, top + height / 2, names - 8);
  pen.textAlign = "right";
  pen.fillText(number, width, top + height / 2);
  pen.textAlign = "left";
  pen.fillStyle = COLOUR.faint;
  pen.fillRect(names, top + height - 1, width - NUMBERS - names, 1);
  pen.fillRect(middle, top, 1, height);
  return (share, from, thick, colour) => {
    const length = (Math.max(-1, Math.min(1, share)) * (width - NUMBERS - names)) / 2;
    pen.fillStyle = colour;
    pen.fillRect(Math.min(middle, middle + length), top + from, Math.abs(length), thick);
  };
}

function paintThrust(pen, run, width, at) {
  const thrust = at("thrust"), names = namesWidth(pen, run, width);
  run.thrusters.forEach((thruster, i) => {
    const share = shareOfLimit(thruster, thrust[i]);
    const bar = paintRow(pen, names, width, 18 * i, 18, thruster.name, `${withDigits(thrust[i], thruster.limits[1])} N`);
    bar(Math.sign(thrust[i]) * share, 4, 10, `#${shareColour(share).getHexString()}`);
  });
}

function paintUncertainty(pen, run, width, at) {
  const actual = at("uncertainty");
  const estimate = run.series.estimate ? at("estimate") : null, names = namesWidth(pen, run, width);
  run.axes.forEach((axis, i) => {
    const bar = paintRow(pen, names, width, 20 * i, 20, axis, withDigits(actual[i], run.scale.uncertainty[i]));
    bar(actual[i] / run.scale.uncertainty[i], 3, 6, COLOUR.uncertainty);
    if (estimate) bar(estimate[i] / run.scale.uncertainty[i], 10, 6, COLOUR.estimate);
  });
}

// One column per rule: up or down by its weight, the darker the more it fires.
function paintRules(pen, run, width, at) {
  const weights = at("weights"), firing = run.series.firing ? at("firing") : null;
  const height = 34, names = namesWidth(pen, run, width), column = (width - names) / run.rules;
  run.axes.forEach((axis, i) => {
    const rows = Array.from({ length: run.rules }, (_, rule) => i * run.rules + rule), top = i * height;
    const most = Math.max(...rows.map((k) => run.peak[k]), 1e-9);
    pen.fillStyle = COLOUR.ink;
    pen.fillText(axis, 0, top + height / 2);
    pen.fillStyle = COLOUR.faint;
    pen.fillRect(names, top + height / 2, width - names, 1);
    rows.forEach((k, rule) => {
      const tall = (weights[k] / most) * (height / 2 - 2);
      pen.fillStyle = `rgba(0, 90, 160, ${firing ? 0.12 + 0.88 * firing[k] : 0.6})`;
      const left = names + rule * column + 1, upper = top + height / 2 - Math.max(tall, 0);
      pen.fillRect(left, upper, Math.max(column - 2, 1), Math.max(Math.abs(tall), 1));
    });
  });
}

function peaksOf(run) {
  if (!run.rules) return [];
  const { width, values } = run.series.weights;
  const peaks = new Array(width).fill(0);
  values.forEach((value, i) => { peaks[i % width] = Math.max(peaks[i % width], Math.abs(value)); });
  return peaks;
}

// A number with as many decimals as tell 1/500 of the scale, or as a power of ten; and no negative zero.
function withDigits(value, scale) {
  if (Math.abs(value) >= 1e5) {
    const [digits, power] = value.toExponential(2).split("e+");
    const raised = [...power].map((digit) => RAISED[digit]).join("");
    return `${digits}\u00d710${raised}`.replace("-", "\u2212");
  }
  const text = value.toFixed(Math.min(Math.max(2 - Math.floor(Math.log10(scale)), 0), 6));
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

function legend(runs, reference) {
  const has = (name) => runs.some((run) => run.series[name]);
  const limited = runs.every((run) => run.limited);
  const entries = [
    ["ramp", `thrust on the vehicle; colour: share of ${limited ? "its limit" : "the largest in this run"}`],
    ["reference", reference],
    ["uncertainty", `lumped uncertainty (translation)${has("estimate") ? "" : "; this law has no estimate"}`],
    ...(has("estimate") ? [["estimate", "its estimate by the controller"]] : []),
    ...(has("water") ? [["water", "velocity of the water"]] : []),
  ];
  return element("ul", { class: "legend" }, ...entries.map(([kind, text]) => element("li", { class: kind }, text)));
}
