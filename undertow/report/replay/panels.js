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

function paintNames(page, scene, runs, time) {
  const width = page.view.clientWidth, height = page.view.clientHeight;
  const pen = clearCanvas(page.overlay, width, height);
  const write = (text, point, colour, line = 0) => {
    const seen = point.clone().project(scene.camera);
    if (seen.z > 1) return;
    const [x, y] = [((seen.x + 1) * width) / 2 + 4, ((1 - seen.y) * height) / 2 + 14 * line];
    pen.lineWidth = 3;
    pen.strokeStyle = "rgba(255,255,255,0.85)";
    pen.strokeText(text, x, y);
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  };
  const within = (object, point) => object.localToWorld(point);
  scene.vehicles.forEach((vehicle, i) => {
    const { run } = vehicle;
    const over = within(vehicle.body, new THREE.Vector3(0, 0, -0.8 * run.size[2]));
    if (runs.length > 1) write(run.label, over, run.colour, i); // below each other: vehicles often coincide
    if (!page.labels.checked) return;
    if (vehicle.water.visible) {
      const speed = Math.hypot(...valueAt(run, "water", time));
      const above = vehicle.water.position.clone().add(new THREE.Vector3(0, 0, -0.12 * run.longest));
      write(`water ${speed.toFixed(2)} m/s`, within(scene.world, above), COLOUR.water);
    }
    if (sizeInView(scene, vehicle, width) < LEAST_FOR_NAMES) return;
    for (const thruster of run.thrusters) {
      write(thruster.name.split(" ")[0], within(vehicle.body, vector(thruster.position)), COLOUR.ink);
    }
  });
  paintCompass(pen, scene.camera, height);
  pen.fillStyle = "#555555";
  pen.textAlign = "right";
  pen.fillText(`grid ${Number(scene.step.toPrecision(3))} m`, width - 8, height - 12);
  pen.textAlign = "left";
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

// A panel: a heading with the scale, and rows of bars. `paint` gets the pen, the run, its width and the time.
function makePanel(page, title, rows, rowHeight, paint) {
  const heading = element("h3", {}, title), canvas = element("canvas", { class: "bars" });
  page.panels.append(heading, canvas);
  return (run, time) => {
    const count = rows(run), width = canvas.clientWidth, height = Math.max(count * rowHeight, 1);
    heading.hidden = canvas.hidden = !count;
    if (!count) return;
    canvas.style.height = `${height}px`;
    paint(clearCanvas(canvas, width, height), run, width, time);
  };
}

const NAMES = 112, NUMBERS = 72; // px, columns of names and numbers

function paintRow(pen, width, top, height, name, number) {
  const middle = (NAMES + width - NUMBERS) / 2;
  pen.fillStyle = COLOUR.ink;
  pen.fillText(name, 0, top + height / 2, NAMES - 8);
  pen.textAlign = "right";
  pen.fillText(number, width, top + height / 2);
  pen.textAlign = "left";
  pen.fillStyle = COLOUR.faint;
  pen.fillRect(NAMES, top + height - 1, width - NUMBERS - NAMES, 1);
  pen.fillRect(middle, top, 1, height);
  return (share, from, thick, colour) => {
    const length = (Math.max(-1, Math.min(1, share)) * (width - NUMBERS - NAMES)) / 2;
    pen.fillStyle = colour;
    pen.fillRect(Math.min(middle, middle + length), top + from, Math.abs(length), thick);
  };
}

function paintThrust(pen, run, width, time) {
  const thrust = valueAt(run, "thrust", time);
  run.thrusters.forEach((thruster, i) => {
    const share = shareOfLimit(thruster, thrust[i]);
    const bar = paintRow(pen, width, 18 * i, 18, thruster.name, `${withDigits(thrust[i], thruster.limits[1])} N`);
    bar(Math.sign(thrust[i]) * share, 4, 10, `#${shareColour(share).getHexString()}`);
  });
}

function paintUncertainty(pen, run, width, time) {
  const actual = valueAt(run, "uncertainty", time);
  const estimate = run.series.estimate ? valueAt(run, "estimate", time) : null;
  run.axes.forEach((axis, i) => {
    const bar = paintRow(pen, width, 20 * i, 20, axis, withDigits(actual[i], run.scale.uncertainty[i]));
    bar(actual[i] / run.scale.uncertainty[i], 3, 6, COLOUR.uncertainty);
    if (estimate) bar(estimate[i] / run.scale.uncertainty[i], 10, 6, COLOUR.estimate);
  });
}

// One column per rule: up or down by its weight, the darker the more it fires.
function paintRules(pen, run, width, time) {
  const weights = valueAt(run, "weights", time), firing = run.series.firing ? valueAt(run, "firing", time) : null;
  const height = 34, column = (width - NAMES) / run.rules;
  run.axes.forEach((axis, i) => {
    const rows = Array.from({ length: run.rules }, (_, rule) => i * run.rules + rule), top = i * height;
    const most = Math.max(...rows.map((k) => run.peak[k]), 1e-9);
    pen.fillStyle = COLOUR.ink;
    pen.fillText(axis, 0, top + height / 2);
    pen.fillStyle = COLOUR.faint;
    pen.fillRect(NAMES, top + height / 2, width - NAMES, 1);
    rows.forEach((k, rule) => {
      const tall = (weights[k] / most) * (height / 2 - 2);
      pen.fillStyle = `rgba(0, 90, 160, ${firing ? 0.12 + 0.88 * firing[k] : 0.6})`;
      const left = NAMES + rule * column + 1, upper = top + height / 2 - Math.max(tall, 0);
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

function showReadings(page, runs, time) {
  const named = (cells) => (runs.length > 1 ? cells : cells.slice(1));
  const row = (kind, cells) => element("tr", {}, ...named(cells).map((cell) => element(kind, {}, cell)));
  const head = ["", "position error, m", "attitude error, deg", "energy, J"];
  const rows = runs.map((run) => {
    const [position, attitude] = valueAt(run, "error", time), [energy] = valueAt(run, "energy", time);
    const ended = time > run.end ? ` (${run.status.replace(/_/g, " ")})` : "";
    return row("td", [`${run.label}${ended}`, withDigits(position, 0.1), withDigits(attitude, 1), withDigits(energy, 100)]);
  });
  page.readings.replaceChildren(row("th", head), ...rows);
}
