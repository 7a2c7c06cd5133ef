// The page: its elements, the clock, and what a visitor does.

const RATES = [1, 2, 5, 10, 20];
const CAPACITY = 3000; // points of the path

function buildLivePage(box, laws, steering) {
  const canvas = element("canvas", { class: "scene", "aria-label": "three-dimensional view of the vehicle" });
  const overlay = element("canvas", { class: "overlay" });
  const happening = element("ol", { class: "happening", "aria-live": "polite" });
  const view = element("div", { class: "view" }, canvas, overlay);
  const play = element("button", { type: "button", class: "play" }, "Pause");
  const reset = element("button", { type: "button" }, "Reset");
  const time = element("output", { class: "time" });
  const speed = choice("speed", [...RATES.map((one) => [one, `${one} times real time`]), ["most", "as fast as it goes"]], 1);
  const law = choice("controller", laws.map(({ name }, i) => [i, name]), 0);
  const camera = choice("camera", [["follow", "follow"], ["whole", "wide"], ["top", "from above"]], "follow");
  const labels = switchOf("names"), forces = switchOf("disturbance");
  const options = element(
    "div", { class: "options" }, element("label", {}, "speed ", speed), element("label", {}, "camera ", camera),
    labels.label, forces.label,
  );
  if (laws.length > 1) options.prepend(element("label", {}, "controller ", law));
  const controls = element("div", { class: "controls" }, play, reset, time);
  const faults = element("div", { class: "faults", role: "group", "aria-label": "faults" });
  const sliders = element("div", { class: "sliders" });
  const panels = element("div", { class: "panels" });
  const drive = element("div", { class: "drive" }, steeringPad(steering), element("div", {}, controls, options));
  const left = [view, happening, drive, faults, sliders];
  box.replaceChildren(element("div", { class: "left" }, ...left), panels);
  return {
    box, view, canvas, overlay, happening, play, reset, time, law, speed, camera, faults, sliders, panels,
    labels: labels.input, forces: forces.input, which: { value: 0 }, places: new Map(),
  };
}

// The vehicle as a run of one instant, for the scene and the panels; the largest loads so far set its scales.
function liveRun(vehicle, start) {
  const frames = { width: 3, values: Array.from({ length: 3 * CAPACITY }, (_, i) => start[i % 3]), frames: CAPACITY };
  const series = { position: frames, desired_position: frames, uncertainty: true, water: true };
  const names = vehicle.thrusters.map((thruster) => thruster.name);
  return {
    ...vehicle, names, series, longest: Math.max(...vehicle.size), rules: 0,
    scale: { uncertainty: new Array(6).fill(0.5), water: 0.5 },
  };
}

function growScales(run, output) {
  const size = (first, last) => Math.hypot(...output.uncertainty.slice(first, last));
  const linear = Math.max(run.scale.uncertainty[0], size(0, 3)), angular = Math.max(run.scale.uncertainty[5], size(3, 6));
  run.scale.uncertainty = [linear, linear, linear, angular, angular, angular];
  run.scale.water = Math.max(run.scale.water, Math.hypot(...output.water));
  if (run.limited) return;
  run.thrusters.forEach((thruster, i) => {
    const most = Math.max(thruster.limits[1], Math.abs(output.thrust[i]));
    thruster.limits = [-most, most];
  });
}

// Roll, pitch and yaw as a quaternion, its scalar part first.
function attitudeOf(angles) {
  const { w, x, y, z } = new THREE.Quaternion().setFromEuler(new THREE.Euler(angles[0], angles[1], angles[2], "ZYX"));
  return [w, x, y, z];
}

// The path, which forgets its older half when it is full.
function makeTrail({ path, reference }) {
  const { data } = path.geometry.attributes.instanceStart;
  let count = 0, last = null;
  reference.visible = false;
  const clear = () => { count = 0; last = null; path.geometry.instanceCount = 0; };
  clear();
  return {
    clear,
    add(point) {
      if (last) {
        if (count === CAPACITY - 1) {
          count = CAPACITY / 2;
          data.array.copyWithin(0, 6 * (CAPACITY - 1 - count), 6 * (CAPACITY - 1));
        }
        data.array.set([...last, ...point], 6 * count);
        data.needsUpdate = true;
        count += 1;
        path.geometry.instanceCount = count;
      }
      last = point;
    },
  };
}

// Buttons that kill thrusters, and one that picks a payload up and puts it down.
function buildFaults(page, data, switches, act) {
  page.faults.replaceChildren(element("span", {}, "Kill a thruster:"));
  const buttons = switches.map(({ label, member, thruster }) => {
    const isPayload = thruster === null;
    const button = element("button", { type: "button", "data-fault": label }, isPayload ? "Pick up the payload" : `${thruster + 1}`);
    if (!isPayload) button.title = data.vehicle.thrusters[thruster].name;
    button.addEventListener("click", () => (isPayload ? act.payload(member, button) : act.kill(member, thruster, button)));
    page.faults.append(button);
    return button;
  });
  return () => buttons.forEach((button) => {
    button.disabled = false;
    if (button.dataset.fault === "payload") button.textContent = "Pick up the payload";
  });
}

function buildSliders(page, sliders, positionOf, turn) {
  page.sliders.replaceChildren();
  for (const slider of sliders) {
    const handle = element("input", { type: "range", min: 0, max: slider.shown.length - 1, step: 1, value: positionOf(slider), "aria-label": slider.label });
    const shown = element("output");
    const say = () => { shown.textContent = `${Number(slider.shown[handle.value].toPrecision(2))} ${slider.unit}`; };
    handle.addEventListener("input", () => { say(); turn(slider, Number(handle.value)); });
    say();
    page.sliders.append(element("label", {}, element("span", {}, slider.label), handle, shown));
  }
}

// What the panels plot of a law: those without an estimate have no bars of it.
function buildPanels(page, data, run) {
  page.panels.replaceChildren();
  const strips = {
    error: makeStrip(page.panels, "Position error, cm", ["position"], false),
    attitude: makeStrip(page.panels, "Attitude error, degrees", ["roll", "pitch", "yaw"], true),
    input: makeStrip(page.panels, `Thruster inputs, ${data.input_unit}`, run.names.map((_, i) => `${i + 1}`), true),
  };
  const estimate = run.series.estimate ? " and estimate (red)" : "";
  const bars = [
    makePanel(page, "Thrust", () => run.thrusters.length, 18, paintThrust),
    makePanel(page, `Uncertainty (black)${estimate}, m/s\u00b2, rad/s\u00b2`, () => run.axes.length, 20, paintUncertainty),
  ];
  page.panels.append(legend([run], "set-point: transparent hull"));
  return { strips, bars };
}

async function startLive(box) {
  const data = JSON.parse(document.getElementById(box.dataset.source).textContent);
  const steering = makeSteering();
  const run = liveRun(data.vehicle, data.start);
  const page = buildLivePage(box, data.laws, steering);
  const reach = 10 * run.longest, corner = screenPoint(data.start);
  const extent = { box: new THREE.Box3(corner.clone(), corner.clone()).expandByScalar(reach), longest: run.longest };
  extent.box.min.y = corner.y - 4 * run.longest;
  extent.box.max.y = corner.y + 4 * run.longest;
  const scene = buildScene(page, [run], extent), [vehicle] = scene.vehicles, trail = makeTrail(vehicle);
  const story = makeStory(page.happening, { ...data, thrusters: run.thrusters.length });
  let engine, loop, output, restore, panels; // of the controller
  let marks = [], steps = 0, playing = true, ended = false, last = performance.now(), owed = 0;
  const spent = { wall: 0, steps: 0 }, shown = { since: last, steps: 0, frames: 0 };

  const at = (name) => {
    if (name === "position") return output.position.slice(0, 3);
    if (name === "desired_position") return output.reference.slice(0, 3);
    if (name === "desired_attitude") return attitudeOf(output.reference.slice(3));
    return output[name];
  };
  const now = () => engine.time();

  function step() {
    steering.advance(engine.steered, output.reference[5], loop.period);
    engine.advance();
    steps += 1;
    if ((steps - 1) % Math.max(1, Math.round(EVERY / loop.period))) return;
    const time = now() - loop.period, { error } = output, { strips } = panels, degrees = (angle) => (angle * 180) / Math.PI;
    const metres = Math.hypot(error[0], error[1], error[2]);
    strips.error.push(time, [100 * metres]);
    strips.attitude.push(time, Array.from(error.slice(3), degrees));
    strips.input.push(time, output.acting_input);
    trail.add(Array.from(at("position")));
    growScales(run, output);
    ended = !story.follow(time, output, metres);
    box.dataset.error = metres;
  }

  // Take the steps that the clock owes, in at most most of the time between two pictures.
  function takeSteps(elapsed) {
    const fastest = page.speed.value === "most";
    owed = fastest ? Infinity : owed + (elapsed / 1000) * Number(page.speed.value);
    const begin = performance.now(), until = begin + Math.max(12, 0.7 * elapsed), before = steps;
    while (owed >= loop.period && !ended && performance.now() < until) {
      step();
      owed -= loop.period;
    }
    owed = Math.min(owed, loop.period);
    spent.wall += performance.now() - begin;
    spent.steps += steps - before;
  }

  function show() {
    followVehicleOrStay();
    const spacing = scene.step, here = screenPoint(at("position")), whole = (value) => spacing * Math.round(value / spacing);
    scene.grid.position.set(whole(here.x), scene.grid.position.y, whole(here.z));
    moveVehicle(vehicle, at, page.forces.checked);
    scene.renderer.render(scene.scene, scene.camera);
    paintNames(page, scene, [run], at);
    Object.values(panels.strips).forEach((strip) => strip.paint(marks));
    panels.bars.forEach((panel) => panel(run, at));
  }

  function followVehicleOrStay() {
    if (scene.followed) followVehicle(scene, at("position"));
  }

  // Twice a second: time, how fast it runs, and how fast it could run.
  function showClock(wall) {
    shown.frames += 1;
    const elapsed = (wall - shown.since) / 1000;
    if (elapsed < 0.5) return;
    const factor = ((steps - shown.steps) * loop.period) / elapsed, most = spent.wall ? (spent.steps * loop.period) / (spent.wall / 1000) : 0;
    Object.assign(box.dataset, { time: now().toFixed(2), factor: factor.toFixed(2), most: most.toFixed(1), frames: (shown.frames / elapsed).toFixed(1) });
    const fast = most ? `, up to ${most.toFixed(0)} \u00d7` : "";
    page.time.textContent = `${now().toFixed(1)} s \u00b7 ${factor.toFixed(1)} \u00d7 real time${fast}`;
    Object.assign(shown, { since: wall, steps, frames: 0 });
    if (spent.wall > 5000) Object.assign(spent, { wall: spent.wall / 2, steps: spent.steps / 2 });
  }

  function advance(wall) {
    const elapsed = Math.min(Math.max(wall - last, 0), 250); // ms; a page that was hidden does not catch up
    last = wall;
    if (playing && !ended) takeSteps(elapsed);
    show();
    showClock(wall);
    requestAnimationFrame(advance);
  }

  function setPlaying(wish) {
    playing = wish;
    page.play.textContent = playing ? "Pause" : "Play";
  }

  function resize() {
    const width = page.view.clientWidth, height = page.view.clientHeight;
    scene.renderer.setSize(width, height, false);
    scene.camera.aspect = width / Math.max(height, 1);
    scene.camera.updateProjectionMatrix();
    for (const line of [vehicle.path, vehicle.reference]) line.material.resolution.set(width, height);
  }

  const faults = {
    kill(member, thruster, button) {
      engine.putTime(member, now());
      engine.renew();
      button.disabled = true;
      run.thrusters[thruster].name = `${run.names[thruster]}: dead`;
      marks.push(now());
      story.kill(now(), thruster);
    },
    payload(member, button) {
      const picksUp = !button.dataset.held;
      engine.putTime(member, picksUp ? now() : loop.never);
      engine.renew();
      button.dataset.held = picksUp ? "yes" : "";
      button.textContent = picksUp ? "Drop the payload" : "Pick up the payload";
      marks.push(now());
      story.say(now(), picksUp ? "The vehicle has picked up the payload." : "The vehicle has dropped the payload.");
      story.watchError(now(), picksUp ? "the payload was picked up" : "the payload was dropped");
    },
  };

  // Where the sliders of water and payload stand stays when the controller changes.
  const positions = new Map();
  const positionOf = (slider) => (slider.of_law ? null : positions.get(slider.label)) ?? slider.base;

  function putPosition(slider, position) {
    positions.set(slider.label, position);
    for (const [member, arrays] of Object.entries(slider.tables)) engine.put(member, arrays[position]);
  }

  function turn(slider, position) {
    putPosition(slider, position);
    engine.renew();
    story.say(now(), `${slider.label}: ${Number(slider.shown[position].toPrecision(2))} ${slider.unit} from now on.`);
  }

  // Give the vehicle another controller, and begin again.
  async function takeLaw(law) {
    page.law.disabled = true;
    engine = await startEngine(law);
    ({ loop } = law);
    ({ output } = engine);
    run.series.estimate = Boolean(output.estimate);
    panels = buildPanels(page, data, run);
    restore = buildFaults(page, data, loop.switches, faults);
    buildSliders(page, loop.sliders, positionOf, turn);
    for (const slider of loop.sliders) putPosition(slider, positionOf(slider));
    page.law.disabled = false;
    reset();
    if (data.laws.length > 1) story.say(now(), `The controller is ${law.name}.`);
  }

  // From the start again, without faults; sliders stay.
  function reset() {
    for (const { member } of loop.switches) engine.putTime(member, loop.never);
    run.thrusters.forEach((thruster, i) => { thruster.name = run.names[i]; });
    steering.stop();
    steering.advance(engine.steered, 0, loop.period);
    engine.begin();
    steps = 0;
    shown.steps = 0;
    marks = [];
    ended = false;
    trail.clear();
    Object.values(panels.strips).forEach((strip) => strip.clear());
    restore();
    page.faults.querySelectorAll("button").forEach((button) => { button.dataset.held = ""; });
    story.clear();
    step();
    placeCamera(scene, page.camera.value, at("position"));
    setPlaying(true);
  }

  page.play.addEventListener("click", () => setPlaying(!playing));
  page.reset.addEventListener("click", reset);
  page.law.addEventListener("change", () => takeLaw(data.laws[page.law.value]));
  page.camera.addEventListener("change", () => placeCamera(scene, page.camera.value, at("position")));
  window.addEventListener("keydown", (event) => {
    if (event.key !== " " || ["BUTTON", "SELECT", "INPUT"].includes(event.target.tagName)) return;
    setPlaying(!playing);
    event.preventDefault();
  });
  new ResizeObserver(resize).observe(page.view);
  resize();
  await takeLaw(data.laws[0]);
  requestAnimationFrame(advance);
}

document.querySelectorAll(".live").forEach((box) => {
  startLive(box).catch((error) => {
    box.textContent = `The page cannot be shown: ${error.message}. It needs WebGL and WebAssembly.`;
  });
});
