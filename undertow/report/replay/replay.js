// The replay: elements of the page, and what happens when the user or the clock asks for another moment.

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 20];

function buildPage(box, runs) {
  const start = Math.min(...runs.map((run) => run.start)), end = Math.max(...runs.map((run) => run.end));
  const canvas = element("canvas", { class: "scene", "aria-label": "three-dimensional view of the run" });
  const overlay = element("canvas", { class: "overlay" });
  const view = element("div", { class: "view" }, canvas, overlay);
  const play = element("button", { type: "button", class: "play" }, "Play");
  const slider = element("input", { type: "range", min: start, max: end, step: 0.01, value: start, "aria-label": "time" });
  const time = element("output", { class: "time" });
  const speed = choice("speed", SPEEDS.map((one) => [one, `${one} times`]), 1);
  const cameras = [["follow", "follow"], ["whole", "whole path"], ["top", "from above"]];
  const camera = choice("camera", cameras, runs.length > 1 ? "whole" : "follow");
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
  box.replaceChildren(element("div", { class: "left" }, view, controls, options, legend(runs, "reference: dashed path and transparent hull")), panels);
  box.tabIndex = 0;
  return {
    box, view, canvas, overlay, play, slider, time, speed, camera, which, readings, panels, start, end,
    labels: labels.input, forces: forces.input, places: new Map(),
  };
}

// The first time at which the thrusters push half as hard as they ever do, s: at the start they often do not push at all.
function openingTime(run) {
  const { frames, width, values } = run.series.thrust;
  const sizes = Array.from({ length: frames }, (_, i) => Math.hypot(...values.slice(i * width, (i + 1) * width)));
  const most = sizes.reduce((one, other) => Math.max(one, other), 0);
  return run.start + (sizes.findIndex((size) => 2 * size >= most) / (frames - 1)) * (run.end - run.start);
}

function showReadings(page, runs, time) {
  const named = (cells) => (runs.length > 1 ? cells : cells.slice(1));
  const row = (kind, cells) => element("tr", {}, ...named(cells).map((cell) => element(kind, {}, cell)));
  const head = ["", "|position error|, m", "|attitude error|, deg", "energy, J"];
  const rows = runs.map((run) => {
    const [position, attitude] = valueAt(run, "error", time), [energy] = valueAt(run, "energy", time);
    const ended = time > run.end ? ` (${run.status.replace(/_/g, " ")})` : "";
    return row("td", [`${run.label}${ended}`, withDigits(position, 0.1), withDigits(attitude, 1), withDigits(energy, 100)]);
  });
  page.readings.replaceChildren(row("th", head), ...rows);
}

// Show the path up to a time, s.
function showPath({ run, path }, time) {
  const share = (time - run.start) / Math.max(run.end - run.start, 1e-9);
  path.geometry.instanceCount = Math.max(1, Math.ceil(Math.min(share, 1) * (run.series.position.frames - 1)));
}

function startReplay(box) {
  const source = JSON.parse(document.getElementById(box.dataset.source).textContent);
  const runs = source.runs.map(unpackRun).map((run) => ({ ...run, peak: peaksOf(run) }));
  const page = buildPage(box, runs);
  let scene;
  try {
    scene = buildScene(page, runs, extentOf(runs));
  } catch (error) {
    page.view.textContent = "This browser offers no WebGL, so the replay cannot be shown. The figures show the same run.";
    return;
  }
  const ruled = (run) => (run.rules ? run.axes.length : 0);
  const what = runs.some((run) => run.series.estimate) ? "Uncertainty (black) and estimate (red)" : "Uncertainty";
  const panels = [
    makePanel(page, "Thrust", (run) => run.thrusters.length, 18, paintThrust),
    makePanel(page, `${what}, m/s\u00b2, rad/s\u00b2`, (run) => run.axes.length, 20, paintUncertainty),
    makePanel(page, "Fuzzy rules: weight (height), firing (darkness)", ruled, 34, paintRules),
  ];
  // The page opens where something happens; until somebody chooses a time, Play begins at the start all the same.
  let time = openingTime(runs[0]), untouched = true, playing = false, last = 0, asked = false;

  const detailed = () => runs[Number(page.which.value)];
  const at = (run) => (name) => valueAt(run, name, time);
  const place = () => at(detailed())("position");

  function show() {
    asked = false;
    if (scene.followed) followVehicle(scene, place());
    scene.vehicles.forEach((vehicle) => {
      moveVehicle(vehicle, at(vehicle.run), page.forces.checked);
      showPath(vehicle, time);
    });
    scene.renderer.render(scene.scene, scene.camera);
    paintNames(page, scene, runs, at(detailed()));
    panels.forEach((panel) => panel(detailed(), at(detailed())));
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
    if (wish && (time >= page.end || untouched)) time = page.start;
    untouched = false;
    playing = wish;
    last = performance.now();
    ask();
  }

  function setTime(wish) {
    time = Math.min(Math.max(wish, page.start), page.end);
    untouched = false;
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
