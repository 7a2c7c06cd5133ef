// Steering: held keys or buttons move the set-point, in the axes of its heading, with a speed that changes smoothly.

const MOVES = [
  { key: "w", arrow: "ArrowUp", label: "forward", sign: "\u2191", axis: 0, speed: 0.4 }, // m/s
  { key: "s", arrow: "ArrowDown", label: "back", sign: "\u2193", axis: 0, speed: -0.4 },
  { key: "a", label: "to port", sign: "\u2190", axis: 1, speed: -0.3 },
  { key: "d", label: "to starboard", sign: "\u2192", axis: 1, speed: 0.3 },
  { key: "q", arrow: "ArrowLeft", label: "turn to port", sign: "\u21ba", axis: 5, speed: -0.5 }, // rad/s
  { key: "e", arrow: "ArrowRight", label: "turn to starboard", sign: "\u21bb", axis: 5, speed: 0.5 },
  { key: "r", label: "up", sign: "\u21e7", axis: 2, speed: -0.3 },
  { key: "f", label: "down", sign: "\u21e9", axis: 2, speed: 0.3 },
];
const LAG = 0.5; // s, of the speed of the set-point

function makeSteering() {
  const position = new Float64Array(6), velocity = new Float64Array(6), held = new Set();

  // Put the set-point of the next step into the input of the loop, and move it on.
  function advance(steered, heading, dt) {
    const wish = new Float64Array(6), acceleration = new Float64Array(6);
    for (const { axis, speed } of held) wish[axis] += speed;
    const [forward, starboard] = wish;
    wish[0] = Math.cos(heading) * forward - Math.sin(heading) * starboard;
    wish[1] = Math.sin(heading) * forward + Math.cos(heading) * starboard;
    for (let i = 0; i < 6; i += 1) acceleration[i] = (wish[i] - velocity[i]) / LAG;
    steered.position.set(position);
    steered.velocity.set(velocity);
    steered.acceleration.set(acceleration);
    for (let i = 0; i < 6; i += 1) {
      position[i] += dt * (velocity[i] + (dt * acceleration[i]) / 2);
      velocity[i] += dt * acceleration[i];
    }
  }

  function stop() {
    held.clear();
    position.fill(0);
    velocity.fill(0);
  }

  return { held, advance, stop };
}

// Buttons that steer while they are pressed; keys do the same wherever the focus is, but in a slider or a choice.
function steeringPad(steering) {
  const pad = element("div", { class: "pad", role: "group", "aria-label": "steering" });
  const buttons = new Map();
  const hold = (move, holds) => {
    if (holds) steering.held.add(move);
    else steering.held.delete(move);
    buttons.get(move).classList.toggle("held", holds);
  };
  for (const move of MOVES) {
    const name = `${move.label} (${move.key.toUpperCase()})`;
    const button = element("button", { type: "button", "aria-label": name, title: name }, move.sign, element("kbd", {}, move.key));
    buttons.set(move, button);
    button.addEventListener("pointerdown", (event) => { button.setPointerCapture(event.pointerId); hold(move, true); });
    for (const end of ["pointerup", "pointercancel"]) button.addEventListener(end, () => hold(move, false));
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    pad.append(button);
  }
  const moveOf = (event) => MOVES.find(({ key, arrow }) => event.key.toLowerCase() === key || event.key === arrow);
  const isTaken = (event) => ["INPUT", "SELECT"].includes(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey;
  window.addEventListener("keydown", (event) => {
    const move = moveOf(event);
    if (!move || isTaken(event)) return;
    hold(move, true);
    event.preventDefault();
  });
  window.addEventListener("keyup", (event) => { if (moveOf(event)) hold(moveOf(event), false); });
  window.addEventListener("blur", () => MOVES.forEach((move) => hold(move, false)));
  return pad;
}
