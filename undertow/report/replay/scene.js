// The scene: vehicles, paths, arrows and the camera, with three.js (global THREE).

const COLOUR = { water: "#1695a3", uncertainty: "#222222", estimate: "#d1495b", faint: "#d9d9d9", ink: "#222222" };
const UP = new THREE.Vector3(0, 1, 0);

function vector(numbers) {
  return new THREE.Vector3(numbers[0], numbers[1], numbers[2]);
}

// three.js has the scalar part of a quaternion last.
function quaternion(numbers) {
  return new THREE.Quaternion(numbers[1], numbers[2], numbers[3], numbers[0]).normalize();
}

// World axes (north, east, down) in those of the screen: x east, y up, z south. Nothing else changes axes: vehicles,
// paths and arrows are in world axes, inside a group that this matrix turns.
function worldToScreen() {
  return new THREE.Matrix4().set(0, 1, 0, 0, 0, 0, -1, 0, -1, 0, 0, 0, 0, 0, 0, 1);
}

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
  const common = { transparent: true, depthWrite: false };
  const look = (color, share) => new THREE.MeshLambertMaterial({ ...common, color, opacity: share * opacity });
  const hull = new THREE.Group();
  const box = new THREE.BoxGeometry(length, width, height);
  const cone = new THREE.ConeGeometry(0.3 * Math.min(width, height), 0.25 * length, 20);
  const bow = new THREE.Mesh(cone, look(colour, 2));
  bow.rotation.z = -Math.PI / 2;
  bow.position.x = 0.625 * length;
  const top = new THREE.Mesh(new THREE.BoxGeometry(0.7 * length, 0.7 * width, 0.05 * height), look("#ffffff", 1.5));
  top.position.z = -0.525 * height;
  hull.add(new THREE.Mesh(box, look(colour, 1)), bow, top);
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

// The scene of some runs inside a box, in the axes of the screen, with vehicles as long as `longest`.
function buildScene(page, runs, { box, longest }) {
  const renderer = new THREE.WebGLRenderer({ canvas: page.canvas, antialias: true });
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  const scene = new THREE.Scene();
  scene.background = new THREE.Color("#f6f9fb");
  scene.add(new THREE.HemisphereLight("#ffffff", "#8899aa", 0.75));
  const sun = new THREE.DirectionalLight("#ffffff", 0.5);
  sun.position.set(1, 3, 2);
  scene.add(sun);
  const { grid, step } = makeGrid(box);
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
  return { renderer, scene, world, vehicles, camera, controls, grid, box, longest, step };
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

// Move a vehicle and its arrows to an instant; `at` gives the components of a series there.
function moveVehicle(vehicle, at, showForces) {
  const { run } = vehicle, thin = 0.03 * run.longest;
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
}
