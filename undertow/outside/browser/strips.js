// Plots of the last seconds, one below the other.

const WINDOW = 60; // s
const EVERY = 0.1; // s between two points
const LINES = ["#0072b2", "#e07b00", "#009e73", "#cc79a7", "#56b4e9", "#8c2d04", "#7a6f00", "#555555"];
const LEFT = 44, BOTTOM = 16; // px, for the numbers

// A plot of some lines with names; `signed` ones have zero in the middle.
function makeStrip(parent, title, names, signed, height = 96) {
  const most = Math.round(WINDOW / EVERY) + 1, values = new Float32Array(most * names.length);
  const canvas = element("canvas", { class: "bars strip", "aria-label": title });
  const keys = names.map((name, i) => {
    const key = element("span", {}, name);
    key.style.setProperty("--line", LINES[i % LINES.length]);
    return key;
  });
  parent.append(element("h3", {}, title, ...(names.length > 1 ? [element("span", { class: "keys" }, ...keys)] : [])), canvas);
  canvas.style.height = `${height}px`;
  let count = 0, end = 0;

  function push(time, row) {
    if (count === most) values.copyWithin(0, names.length);
    else count += 1;
    values.set(row, (count - 1) * names.length);
    end = time;
  }

  function paint(marks) {
    const width = canvas.clientWidth, pen = clearCanvas(canvas, width, height);
    let largest = 1e-9;
    for (let i = 0; i < count * names.length; i += 1) largest = Math.max(largest, Math.abs(values[i]));
    const top = niceStep(1.02 * largest), low = signed ? -top : 0;
    const from = Math.max(end - WINDOW, 0), x = (time) => LEFT + ((time - from) / WINDOW) * (width - LEFT - 2);
    const y = (value) => 5 + ((top - value) / (top - low)) * (height - BOTTOM - 8);
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "right";
    for (const value of signed ? [-top, 0, top] : [0, top / 2, top]) {
      pen.fillStyle = COLOUR.faint;
      pen.fillRect(LEFT, y(value), width - LEFT, 1);
      pen.fillStyle = "#555555";
      pen.fillText(withDigits(value, top), LEFT - 5, y(value) + 0.5);
    }
    pen.textAlign = "center";
    for (let time = 10 * Math.ceil(from / 10); time <= from + WINDOW; time += 10) {
      if (x(time) < width - 14) pen.fillText(`${time}`, x(time), height - BOTTOM / 2 + 1);
    }
    pen.textAlign = "left";
    for (const time of marks) {
      pen.fillStyle = "#c1121f";
      if (time >= from) pen.fillRect(x(time), 5, 1.5, height - BOTTOM - 8);
    }
    names.forEach((_, line) => {
      pen.strokeStyle = LINES[line % LINES.length];
      pen.lineWidth = 1.3;
      pen.beginPath();
      for (let i = 0; i < count; i += 1) {
        pen.lineTo(x(end - (count - 1 - i) * EVERY), y(values[i * names.length + line]));
      }
      pen.stroke();
    });
  }

  return { push, paint, clear: () => { count = 0; } };
}
