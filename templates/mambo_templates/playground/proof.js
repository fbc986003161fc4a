/* The flight that the native engine flew too: engine_fly with the same records and random numbers. */
const TRACE_AXES = [3, 3, 3, 2, 1, 1, 3, 3, 3];
const TARGET_PLACE = 3; /* in a trace, the target follows position, velocity and angles */
const LEVEL_COLUMNS = 6, TARGET_COLUMNS = 9; /* x, y, vx, vy, ax, ay; and height, climb, its acceleration */

async function sha256(parts) {
  const whole = new Uint8Array(await new Blob(parts).arrayBuffer());
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", whole));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/* The targets of a level course with its height, as controllers that command the thrust read them. */
function inSpace(level, height) {
  const updates = level.length / LEVEL_COLUMNS, targets = new Float64Array(TARGET_COLUMNS * updates);
  for (let update = 0; update < updates; update++) {
    targets.set(level.subarray(LEVEL_COLUMNS * update, LEVEL_COLUMNS * (update + 1)), TARGET_COLUMNS * update);
    targets[TARGET_COLUMNS * update + LEVEL_COLUMNS] = height;
  }
  return targets;
}

/* The digest of the trace of one controller's flight, as Trace.digest computes it. */
async function traceDigest(entry, data) {
  const module = await Module.load(entry), { proof } = data, { updates } = proof;
  const times = Float64Array.from({ length: updates }, (_, update) => data.period_s * update);
  const [simulation, flight, sensors, gusts] =
    ["simulation", "flight", "sensors", "gusts"].map((name) => module.put(bytesOf(proof[name])));
  const level = new Float64Array(bytesOf(proof.targets).buffer);
  const targets = entry.lifts ? inSpace(level, data.height_m) : level, columns = targets.length / updates;
  const flies = { lifting: entry.lifts ? 1n : 0n, target_columns: BigInt(columns) };
  for (const [member, value] of Object.entries(flies)) {
    module.at(simulation + data.offsets.simulation[member], 1, BigInt64Array)[0] = value;
  }
  const arrays = TRACE_AXES.map((axes) => module.space(8 * axes * updates));
  module.calls.engine_fly(
    simulation, flight, 0n, module.put(new Uint8Array(times.buffer)), module.put(new Uint8Array(targets.buffer)),
    module.pointers(sensors, gusts, 0), module.step, module.self, 0n, module.pointers(...arrays),
  );
  const parts = arrays.map((address, place) => module.at(address, TRACE_AXES[place] * updates));
  parts.splice(TARGET_PLACE, 0, targets.filter((_, index) => index % columns < 4));
  return sha256([times, ...parts]);
}

/* The digests in this browser, in the order of the drones; an error's message where a module fails. */
function proveAll(data) {
  return Promise.all(data.drones.map((entry) => traceDigest(entry, data).catch((error) => String(error))));
}
