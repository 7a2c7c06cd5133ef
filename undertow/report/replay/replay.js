// Shows the runs that `replay_data.py` has packed, with three.js (global THREE). Loads nothing from anywhere.
//
// `startReplay` at the end puts the pieces together; before it come the data, the page, the scene, and the panels.
"use strict";

(() => {
  const COLOUR = { water: "#1695a3", uncertainty: "#222222", estimate: "#d1495b", faint: "#d9d9d9", ink: "#222222" };
  const OUTPUT_AXES = ["north", "east", "down", "roll", "pitch", "yaw"];
  const BODY_AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"];
  const LEAST_FOR_NAMES = 80; // px; names of thrusters would cover each other on a smaller vehicle
  const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20];
  const UP = new THREE.Vector3(0, 1, 0);

  // World axes (north, east, down) in those of the screen: x east, y up, z south. Nothing else changes axes: vehicles,
  // paths and arrows are in world axes, inside a group that this matrix turns.
  function worldToScreen() {
    return new THREE.Matrix4().set(0, 1, 0, 0, 0, 0, -1, 0, -1, 0, 0, 0, 0, 0, 0, 1);
  }

  // ---------------------------------------------------------------- data

  function unpackSeries(packed) {
    const bytes = Uint8Array.from(atob(packed.data), (letter) => letter.charCodeAt(0));
    const whole = packed.bytes === 1 ? bytes : new Uint16Array(bytes.buffer);
    const width = packed.low.length, levels = 256 ** packed.bytes - 1;
    const values = new Float32Array(whole.length);
    for (let i = 0; i < values.length; i += 1) {
      const low = packed.low[i % width];
      values[i] = low + (whole[i] / levels) * (packed.high[i % width] - low);
    }
    return { width, values, frames: whole.length / width };
  }

  function unpackRun(run) {
    const series = {};
    for (const name of Object.keys(run.series)) series[name] = unpackSeries(run.series[name]);
    const axes = run.body_axes ? BODY_AXES : OUTPUT_AXES;
    const rules = series.weights ? series.weights.width / axes.length : 0;
    const longest = Math.max(...run.size);
    const named = { ...run, series, axes, rules, longest };
    return { ...named, scale: { uncertainty: scalesOf(named), water: usualSize(named, "water", 0, 3) } };
  }

  // Components of a series at a time, s, between the two frames around it.
  function valueAt(run, name, time) {
    const { width, values, frames } = run.series[name];
    const share = (time - run.start) / Math.max(run.end - run.start, 1e-9);
    const place = Math.min(Math.max(share, 0), 1) * (frames - 1);
    const before = Math.floor(place), after = Math.min(before + 1, frames - 1), part = place - before;
    return Array.from({ length: width }, (_, i) => {
      const from = values[before * width + i];
      return from + part * (values[after * width + i] - from);
    });
  }

  // Size of a vector (components `first` to `last`) that is exceeded in 1 % of the frames: the full length of its arrow.
  function usualSize(run, name, first, last) {
    if (!run.series[name]) return 0;
    const { width, values, frames } = run.series[name], sizes = [];
    for (let i = 0; i < frames; i += 1) sizes.push(Math.hypot(...values.slice(i * width + first, i * width + last)));
    return sizes.sort((a, b) => a - b)[Math.floor(0.99 * (sizes.length - 1))];
  }

  function scalesOf(run) {
    const linear = usualSize(run, "uncertainty", 0, 3), angular = usualSize(run, "uncertainty", 3, 6);
    return [linear, linear, linear, angular, angular, angular].map((scale) => Math.max(scale, 1e-6));
  }

  function vector(numbers) {
    return new THREE.Vector3(numbers[0], numbers[1], numbers[2]);
  }

  // three.js has the scalar part of a quaternion last.
  function quaternion(numbers) {
    return new THREE.Quaternion(numbers[1], numbers[2], numbers[3], numbers[0]).normalize();
  }

  // ---------------------------------------------------------------- page

  function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  function choice(name, options, chosen) {
    const made = element("select", { "aria-label": name });
    for (const [value, text] of options) made.append(element("option", { value }, text));
    made.value = chosen;
    return made;
  }

  function switchOf(text) {
    const input = element("input", { type: "checkbox" });
    input.checked = true;
    return { input, label: element("label", {}, input, ` ${text}`) };
  }

  function buildPage(box, runs) {
    const start = Math.min(...runs.map((run) => run.start)), end = Math.max(...runs.map((run) => run.end));
    const canvas = element("canvas", { class: "scene", "aria-label": "three-dimensional view of the run" });
    const overlay = element("canvas", { class: "overlay" });
    const view = element("div", { class: "view" }, canvas, overlay);
    const play = element("button", { type: "button", class: "play" }, "Play");
    const slider = element("input", { type: "range", min: start, max: end, step: 0.01, value: start, "aria-label": "time" });
    const time = element("output", { class: "time" });
    const speed = choice("speed", SPEEDS.map((one) => [one, `${one} times`]), 1);
    const camera = choice("camera", [["follow", "follow"], ["whole", "whole path"], ["top", "from above"]], runs.length > 1 ? "whole" : "follow");
    const which = choice("run", runs.map((run, i) => [i, run.label]), 0);
    const labels = switchOf("names"), forces = switchOf("disturbance");
    const options = element(
      "div", { class: "options" },
      element("label", {}, "speed ", speed), element("label", {}, "camera ", camera), labels.label, forces.label,
      ...(runs.length > 1 ? [element("label", {}, "details of ", which)] : []),
    );
    const readings = element("table", { class: "readings" });
    const panels = element("div", { class: "panels" }, readings);
    const controls = element("div", { class: "controls" }, play, slider, time);
    box.replaceChildren(element("div", { class: "left" }, view, controls, options, legend(runs)), panels);
    box.tabIndex = 0;
    return {
      box, view, canvas, overlay, play, slider, time, speed, camera, which, readings, panels, start, end,
      labels: labels.input, forces: forces.input,
    };
  }

  function legend(runs) {
    const has = (name) => runs.some((run) => run.series[name]);
    const limited = runs.every((run) => run.limited);
    const entries = [
      ["ramp", `thrust on the vehicle; colour: share of ${limited ? "its limit" : "the largest in this run"}`],
      ["reference", "reference: dashed path and transparent hull"],
      ["uncertainty", `lumped uncertainty (translation)${has("estimate") ? "" : "; this law has no estimate"}`],
      ...(has("estimate") ? [["estimate", "its estimate by the controller"]] : []),
      ...(has("water") ? [["water", "velocity of the water"]] : []),
    ];
    return element("ul", { class: "legend" }, ...entries.map(([kind, text]) => element("li", { class: kind }, text)));
  }

  // ---------------------------------------------------------------- scene

  // An arrow along +y of length 1, to be set by `setArrow`.
  function makeArrow(colour) {
    const material = new THREE.MeshBasicMaterial({ color: colour });
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.5, 0.5, 1, 12), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1.4, 1, 16), material);
    const arrow = new THREE.Group();
    arrow.add(shaft, head);
    return Object.assign(arrow, { material, shaft, head });
  }

  function setArrow(arrow, from, along, length, width) {
    arrow.visible = length > 0.02 * width && along.lengthSq() > 0;
    if (!arrow.visible) return;
    const tip = Math.min(3 * width, 0.6 * length);
    arrow.position.copy(from);
    arrow.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    arrow.shaft.scale.set(width, length - tip, width);
    arrow.shaft.position.y = (length - tip) / 2;
    arrow.head.scale.set(width, tip, width);
    arrow.head.position.y = length - tip / 2;
  }

  // A hull as a box with a cone on its bow and a light plate on top; one sees the arrows inside it.
  function makeHull(run, colour, opacity) {
    const [length, width, height] = run.size;
    const look = (shade, share = opacity) => new THREE.MeshLambertMaterial({ color: shade, transparent: true, opacity: share, depthWrite: false });
    const hull = new THREE.Group();
    const box = new THREE.BoxGeometry(length, width, height);
    const bow = new THREE.Mesh(new THREE.ConeGeometry(0.3 * Math.min(width, height), 0.25 * length, 20), look(colour, 2 * opacity));
    bow.rotation.z = -Math.PI / 2;
    bow.position.x = 0.625 * length;
    const top = new THREE.Mesh(new THREE.BoxGeometry(0.7 * length, 0.7 * width, 0.05 * height), look("#ffffff", 1.5 * opacity));
    top.position.z = -0.525 * height;
    hull.add(new THREE.Mesh(box, look(colour)), bow, top);
    hull.add(new THREE.LineSegments(new THREE.EdgesGeometry(box), new THREE.LineBasicMaterial({ color: colour })));
    return hull;
  }

  function makePath(run, name, colour, width, dashed) {
    const { values } = run.series[name];
    const geometry = new THREE.LineGeometry();
    geometry.setPositions(values);
    const size = 0.25 * run.longest;
    const material = new THREE.LineMaterial({ color: colour, linewidth: width, dashed, dashSize: size, gapSize: size });
    const line = new THREE.Line2(geometry, material);
    if (dashed) {
      material.defines.USE_DASH = "";
      line.computeLineDistances();
    }
    line.frustumCulled = false;
    return line;
  }

  function makeVehicle(run, world) {
    const arrows = run.thrusters.map(() => makeArrow("#000000"));
    const vehicle = {
      run, arrows,
      body: new THREE.Group(),
      ghost: makeHull(run, "#9a9a9a", 0.2),
      path: makePath(run, "position", run.colour, 3, false),
      reference: makePath(run, "desired_position", "#777777", 1.5, true),
      uncertainty: makeArrow(COLOUR.uncertainty), estimate: makeArrow(COLOUR.estimate), water: makeArrow(COLOUR.water),
    };
    vehicle.body.add(makeHull(run, run.colour, 0.4), ...arrows);
    world.add(vehicle.body, vehicle.ghost, vehicle.path, vehicle.reference);
    world.add(vehicle.uncertainty, vehicle.estimate, vehicle.water);
    return vehicle;
  }

  // Box around all paths, in the axes of the screen, and the length of the largest vehicle.
  function extentOf(runs) {
    const extent = new THREE.Box3(), turn = worldToScreen();
    for (const run of runs) {
      for (const name of ["position", "desired_position"]) {
        const { values } = run.series[name];
        for (let i = 0; i < values.length; i += 3) extent.expandByPoint(vector(values.slice(i, i + 3)).applyMatrix4(turn));
      }
    }
    const longest = Math.max(...runs.map((run) => run.longest));
    return { box: extent.expandByScalar(0.6 * longest), longest };
  }

  function niceStep(length) {
    const power = 10 ** Math.floor(Math.log10(length));
    return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= length);
  }

  // Horizontal grid below everything; its lines lie on whole multiples of its spacing.
  function makeGrid(extent) {
    const size = extent.getSize(new THREE.Vector3()), centre = extent.getCenter(new THREE.Vector3());
    const step = niceStep(Math.max(size.x, size.z) / 10);
    const cells = 2 * Math.ceil(Math.max(size.x, size.z) / step / 2 + 1);
    const grid = new THREE.GridHelper(cells * step, cells, "#b8c4cc", "#dde4e8");
    const whole = (value) => step * Math.round(value / step);
    grid.position.set(whole(centre.x), extent.min.y, whole(centre.z));
    return { grid, step };
  }

  function buildScene(page, runs) {
    const renderer = new THREE.WebGLRenderer({ canvas: page.canvas, antialias: true });
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const scene = new THREE.Scene();
    scene.background = new THREE.Color("#f6f9fb");
    scene.add(new THREE.HemisphereLight("#ffffff", "#8899aa", 0.75));
    const sun = new THREE.DirectionalLight("#ffffff", 0.5);
    sun.position.set(1, 3, 2);
    scene.add(sun);
    const { box, longest } = extentOf(runs), { grid, step } = makeGrid(box);
    const world = new THREE.Group();
    world.setRotationFromMatrix(worldToScreen());
    scene.add(grid, world);
    const vehicles = runs.map((run) => makeVehicle(run, world));
    const span = box.getSize(new THREE.Vector3()).length();
    const camera = new THREE.PerspectiveCamera(40, 1, longest / 50, 20 * span);
    const controls = new THREE.OrbitControls(camera, page.canvas);
    controls.enableZoom = false; // a wheel over the view scrolls the page, until the view is clicked
    page.canvas.addEventListener("pointerdown", () => { controls.enableZoom = true; });
    page.view.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") controls.enableZoom = false; });
    return { renderer, scene, world, vehicles, camera, controls, box, longest, step };
  }

  function screenPoint(worldPoint) {
    return vector(worldPoint).applyMatrix4(worldToScreen());
  }

  // Place the camera: over the whole path, behind and above the vehicle, or straight above the path with north at the top.
  function placeCamera(scene, kind, position) {
    const { camera, controls, box, longest } = scene, here = screenPoint(position);
    const shown = kind === "follow" ? new THREE.Box3(here, here.clone()).expandByScalar(0.85 * longest) : box;
    const direction = kind === "top" ? new THREE.Vector3(0, 1, 1e-4) : new THREE.Vector3(0.55, 0.5, 0.8);
    shown.getCenter(controls.target);
    fitInView(camera, shown, controls.target, direction.normalize());
    controls.update();
    scene.followed = kind === "follow" ? here : null;
  }

  // Distance at which a box just fills the view: its size there is inversely proportional to the distance, nearly.
  function fitInView(camera, box, centre, direction) {
    let distance = 2 * box.getSize(new THREE.Vector3()).length();
    for (let step = 0; step < 4; step += 1) {
      camera.position.copy(centre).addScaledVector(direction, distance);
      camera.lookAt(centre);
      camera.updateMatrixWorld();
      let most = 0;
      for (let corner = 0; corner < 8; corner += 1) {
        const at = [corner & 1, corner & 2, corner & 4].map((high, i) => (high ? box.max : box.min).getComponent(i));
        const seen = vector(at).project(camera);
        most = Math.max(most, Math.abs(seen.x), Math.abs(seen.y));
      }
      distance *= most / 0.92;
    }
  }

  // Move the camera with the vehicle, as far as it has moved since the last frame.
  function followVehicle(scene, position) {
    const here = screenPoint(position), moved = here.clone().sub(scene.followed);
    scene.camera.position.add(moved);
    scene.controls.target.add(moved);
    scene.followed = here;
    scene.controls.update();
  }

  // Amber for little, red for all.
  function shareColour(share) {
    return new THREE.Color("#eab64d").lerp(new THREE.Color("#b3001b"), Math.min(1, share));
  }

  function shareOfLimit(thruster, thrust) {
    return Math.abs(thrust) / Math.max(Math.abs(thruster.limits[thrust < 0 ? 0 : 1]), 1e-9);
  }

  function moveVehicle(vehicle, time, showForces) {
    const { run } = vehicle, at = (name) => valueAt(run, name, time), thin = 0.03 * run.longest;
    const position = vector(at("position")), attitude = quaternion(at("attitude"));
    vehicle.body.position.copy(position);
    vehicle.body.quaternion.copy(attitude);
    vehicle.ghost.position.copy(vector(at("desired_position")));
    vehicle.ghost.quaternion.copy(quaternion(at("desired_attitude")));
    const thrust = at("thrust");
    run.thrusters.forEach((thruster, i) => {
      const share = shareOfLimit(thruster, thrust[i]), arrow = vehicle.arrows[i];
      arrow.material.color.copy(shareColour(share));
      const along = vector(thruster.direction).multiplyScalar(Math.sign(thrust[i]));
      setArrow(arrow, vector(thruster.position), along, 1.5 * share * run.longest, thin);
    });
    for (const name of ["uncertainty", "estimate"]) {
      const along = run.series[name] && showForces ? vector(at(name)) : new THREE.Vector3();
      if (run.body_axes) along.applyQuaternion(attitude);
      const length = Math.min(along.length() / run.scale.uncertainty[0], 1.5) * 1.3 * run.longest;
      setArrow(vehicle[name], position, along, length, (name === "estimate" ? 1.1 : 1.6) * thin);
    }
    const water = run.series.water ? vector(at("water")) : new THREE.Vector3();
    const above = position.clone().add(new THREE.Vector3(0, 0, -0.9 * run.longest));
    setArrow(vehicle.water, above, water, (water.length() / Math.max(run.scale.water, 1e-9)) * run.longest, 1.3 * thin);
    const share = (time - run.start) / Math.max(run.end - run.start, 1e-9);
    vehicle.path.geometry.instanceCount = Math.max(1, Math.ceil(Math.min(share, 1) * (run.series.position.frames - 1)));
  }

  // ---------------------------------------------------------------- flat pictures: names in the view, and bars

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
    const write = (text, point, colour) => {
      const seen = point.clone().project(scene.camera);
      if (seen.z > 1) return;
      const [x, y] = [((seen.x + 1) * width) / 2 + 4, ((1 - seen.y) * height) / 2];
      pen.lineWidth = 3;
      pen.strokeStyle = "rgba(255,255,255,0.85)";
      pen.strokeText(text, x, y);
      pen.fillStyle = colour;
      pen.fillText(text, x, y);
    };
    const within = (object, point) => object.localToWorld(point);
    scene.vehicles.forEach((vehicle) => {
      const { run } = vehicle;
      if (runs.length > 1) write(run.label, within(vehicle.body, new THREE.Vector3(0, 0, -0.8 * run.size[2])), run.colour);
      if (!page.labels.checked) return;
      if (vehicle.water.visible) {
        const speed = Math.hypot(...valueAt(run, "water", time));
        write(`water ${speed.toFixed(2)} m/s`, within(scene.world, vehicle.water.position.clone().add(new THREE.Vector3(0, 0, -0.12 * run.longest))), COLOUR.water);
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

  const NAMES = 112, NUMBERS = 62; // px, columns of names and numbers

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
        pen.fillRect(NAMES + rule * column + 1, top + height / 2 - Math.max(tall, 0), Math.max(column - 2, 1), Math.max(Math.abs(tall), 1));
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

  // A number with as many decimals as tell 1/500 of the scale, and no negative zero.
  function withDigits(value, scale) {
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
      return row("td", [`${run.label}${ended}`, position.toFixed(3), attitude.toFixed(2), energy.toFixed(0)]);
    });
    page.readings.replaceChildren(row("th", head), ...rows);
  }

  // ---------------------------------------------------------------- all together

  function startReplay(box) {
    const source = JSON.parse(document.getElementById(box.dataset.source).textContent);
    const runs = source.runs.map(unpackRun).map((run) => ({ ...run, peak: peaksOf(run) }));
    const page = buildPage(box, runs);
    let scene;
    try {
      scene = buildScene(page, runs);
    } catch (error) {
      page.view.textContent = "This browser offers no WebGL, so the replay cannot be shown. The figures show the same run.";
      return;
    }
    const estimated = (run) => (run.series.estimate ? "Uncertainty (black) and estimate (red), m/s\u00b2, rad/s\u00b2" : "Uncertainty, m/s\u00b2, rad/s\u00b2");
    const panels = [
      makePanel(page, "Thrust", (run) => run.thrusters.length, 18, paintThrust),
      makePanel(page, estimated(runs[0]), (run) => run.axes.length, 20, paintUncertainty),
      makePanel(page, "Fuzzy rules: weight (height), firing (darkness)", (run) => (run.rules ? run.axes.length : 0), 34, paintRules),
    ];
    let time = page.start, playing = false, last = 0, asked = false;

    const detailed = () => runs[Number(page.which.value)];
    const place = () => valueAt(detailed(), "position", time);

    function show() {
      asked = false;
      if (scene.followed) followVehicle(scene, place());
      scene.vehicles.forEach((vehicle) => moveVehicle(vehicle, time, page.forces.checked));
      scene.renderer.render(scene.scene, scene.camera);
      paintNames(page, scene, runs, time);
      panels.forEach((panel) => panel(detailed(), time));
      showReadings(page, runs, time);
      page.slider.value = time;
      page.time.textContent = `${time.toFixed(2)} s of ${Number(page.end.toPrecision(6))} s`;
      page.play.textContent = playing ? "Pause" : "Play";
      if (!box.dataset.firstFrame) box.dataset.firstFrame = Math.round(performance.now());
    }

    function ask() {
      if (!asked) requestAnimationFrame(advance);
      asked = true;
    }

    function advance(now) {
      if (playing) {
        time = Math.min(page.end, time + (Math.min(now - last, 200) / 1000) * Number(page.speed.value));
        playing = time < page.end;
      }
      last = now;
      show();
      if (playing) ask();
    }

    function setPlaying(wish) {
      if (wish && time >= page.end) time = page.start;
      playing = wish;
      last = performance.now();
      ask();
    }

    function setTime(wish) {
      time = Math.min(Math.max(wish, page.start), page.end);
      ask();
    }

    function resize() {
      const width = page.view.clientWidth, height = page.view.clientHeight;
      scene.renderer.setSize(width, height, false);
      scene.camera.aspect = width / Math.max(height, 1);
      scene.camera.updateProjectionMatrix();
      for (const vehicle of scene.vehicles) {
        for (const line of [vehicle.path, vehicle.reference]) line.material.resolution.set(width, height);
      }
      ask();
    }

    function pressed(event) {
      const moves = { ArrowLeft: -1, ArrowRight: 1 }, from = event.target.tagName;
      if (event.key === " " && from !== "BUTTON" && from !== "SELECT") setPlaying(!playing);
      else if (event.key in moves && from !== "SELECT") setTime(time + moves[event.key] * (event.shiftKey ? 10 : 1));
      else if (event.key === "Home") setTime(page.start);
      else if (event.key === "End") setTime(page.end);
      else return;
      event.preventDefault();
    }

    // `run.html#t=12` opens at 12 s.
    const asks = /^#t=([\d.]+)$/.exec(window.location.hash);
    if (asks) setTime(Number(asks[1]));
    page.play.addEventListener("click", () => setPlaying(!playing));
    page.slider.addEventListener("input", () => setTime(Number(page.slider.value)));
    page.camera.addEventListener("change", () => { placeCamera(scene, page.camera.value, place()); ask(); });
    for (const input of [page.labels, page.forces, page.which]) input.addEventListener("change", ask);
    scene.controls.addEventListener("change", ask);
    box.addEventListener("keydown", pressed);
    new ResizeObserver(resize).observe(page.view);
    resize();
    placeCamera(scene, page.camera.value, place());
    show();
  }

  document.querySelectorAll(".replay").forEach(startReplay);
})();
