// The closed loop in WebAssembly: its memory as arrays by name, its start and its steps.

const ARRAYS = {
  float64: Float64Array, float32: Float32Array, int32: Int32Array, uint32: Uint32Array,
  int64: BigInt64Array, uint64: BigUint64Array, bool: Uint8Array,
};

async function startEngine({ module, loop }) {
  const { instance } = await WebAssembly.instantiate(bytesOf(module));
  const { memory, _initialize, ...calls } = instance.exports;
  if (_initialize) _initialize();
  const structs = { state: "state", started: "state", input: "input", output: "output" };
  const views = {}, whole = {};
  for (const [struct, layout] of Object.entries(structs)) {
    const address = calls[`${struct}_address`](), { bytes, members } = loop.layouts[layout];
    whole[struct] = new Uint8Array(memory.buffer, address, bytes);
    views[struct] = {};
    for (const [name, { offset, type, count }] of Object.entries(members)) {
      views[struct][name] = new ARRAYS[type](memory.buffer, address + offset, count);
    }
  }
  const { input, output } = views;
  let step = 0;
  const engine = {
    output,
    steered: { position: input.steered_position, velocity: input.steered_velocity, acceleration: input.steered_acceleration },
    time: () => step * loop.period, // of the next step, s
    // Set the array of a slider, given as base64; `renew` makes it known.
    put: (name, text) => new Uint8Array(memory.buffer, input[name].byteOffset, input[name].byteLength).set(bytesOf(text)),
    putTime: (name, time) => input[name].fill(time),
    // What the seed realizes follows numbers that have changed; what was reached stays.
    renew() {
      calls.start();
      for (const name of Object.keys(views.state)) {
        if (name.startsWith("realized")) views.state[name].set(views.started[name]);
      }
    },
    begin() {
      calls.start();
      whole.state.set(whole.started);
      step = 0;
    },
    advance() {
      input.k[0] = step;
      calls.step();
      step += 1;
    },
  };
  whole.input.set(bytesOf(loop.input));
  engine.begin();
  return engine;
}
