// What happens, in plain words: faults, what the supervisor makes of them, and when the error is small again.

const ENTRIES = 3;
const CALM = 2; // s below the bound until the error counts as small again
const PATIENCE = 5; // s after which an error that stayed below it is said to have done so

function makeStory(list, { bound, states, statuses, thrusters }) {
  const centimetres = (metres) => `${(100 * metres).toFixed(metres < 0.1 ? 1 : 0)} cm`;
  const seconds = (time) => `${time.toFixed(1)} s`;
  let killed, lost, state, watched;

  function clear() {
    killed = new Map(); // thruster -> when, s
    lost = new Array(thrusters).fill(false);
    state = 0;
    watched = null;
    list.replaceChildren(element("li", {}, "Everything works. Steer, or break something."));
  }

  function say(time, text) {
    list.prepend(element("li", {}, element("b", {}, seconds(time)), ` ${text}`));
    while (list.children.length > ENTRIES) list.lastChild.remove();
  }

  // Say how the error goes on after something has happened.
  function watchError(time, what) {
    watched = { time, what, worst: 0, since: null };
  }

  function kill(time, thruster) {
    killed.set(thruster, time);
    say(time, `Thruster ${thruster + 1} is dead.`);
    watchError(time, `thruster ${thruster + 1} died`);
  }

  function followError(time, error) {
    watched.worst = Math.max(watched.worst, error);
    watched.since = error < bound ? (watched.since ?? time) : null;
    if (watched.worst < bound && time > watched.time + PATIENCE) {
      say(time, `The position error has stayed below ${centimetres(bound)} since ${watched.what}.`);
      watched = null;
    } else if (watched.worst >= bound && watched.since !== null && time > watched.since + CALM) {
      const after = seconds(watched.since - watched.time);
      say(time, `Position error below ${centimetres(bound)} again, ${after} after ${watched.what}; at worst ${centimetres(watched.worst)}.`);
      watched = null;
    }
  }

  function followThrusters(time, found) {
    found.forEach((value, i) => {
      const out = value > 0.5, number = `thruster ${i + 1}`;
      if (out === lost[i]) return;
      lost[i] = out;
      if (!out) say(time, `The supervisor uses ${number} again.`);
      else if (!killed.has(i)) say(time, `The supervisor takes ${number} out of use.`);
      else say(time, `Thruster ${i + 1} is dead; the supervisor found it after ${seconds(time - killed.get(i))}, and the others take over.`);
    });
  }

  // Below ACTIVE the controller has not begun; ACTIVE and DEGRADED are shown by what is lost.
  function followState(time, now) {
    const isSafe = (number) => number >= 4;
    if (isSafe(now) && now !== state) say(time, `${states[now].name}: ${states[now].meaning}`);
    if (isSafe(state) && !isSafe(now)) say(time, "The supervisor gives control back to the controller.");
    state = now;
  }

  // Follow an instant, s; true while the loop may go on.
  function follow(time, output, error) {
    if (output.lost_thrusters) followThrusters(time, output.lost_thrusters);
    if (output.supervisor_state) followState(time, output.supervisor_state[0]);
    if (watched) followError(time, error);
    const status = Number(output.status[0]);
    if (status !== 0) say(time, `The run has ended. ${statuses[status]}`);
    return status === 0;
  }

  clear();
  return { clear, say, kill, follow, watchError };
}
