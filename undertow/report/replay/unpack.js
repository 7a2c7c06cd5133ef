// What `replay_data.py` has packed, unpacked: runs with series whose values can be asked for at any time.

function unpackSeries(packed) {
  const bytes = bytesOf(packed.data);
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
  const rules = series.weights ? series.weights.width / run.axes.length : 0;
  const longest = Math.max(...run.size);
  const named = { ...run, series, rules, longest };
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
