"use strict";
/* One instance of WebAssembly: engine and controller, and memory for what the page passes to them. */
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

class Module {
  static async load(entry) {
    const { instance } = await WebAssembly.instantiate(bytesOf(entry.wasm));
    return new Module(instance.exports, entry);
  }

  constructor(calls, entry) {
    this.calls = calls;
    this.end = calls.__heap_base.value;
    this.step = calls.playground_controller();
    this.generated = entry.constants === null;
    this.record = this.generated ? null : bytesOf(entry.constants);
    this.self = this.generated ? this.space(calls.nmpc_batch_instance_bytes()) : this.put(this.record);
    this.reset();
  }

  /* Puts the controller at its start. */
  reset() {
    if (this.generated) this.calls.nmpc_batch_init(this.self, 1);
    else this.at(this.self, this.record.length, Uint8Array).set(this.record);
  }

  /* Returns the address of `size` bytes that are 0. */
  space(size) {
    const address = (this.end + 15) & ~15, { memory } = this.calls;
    this.end = address + size;
    const missing = this.end - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / 65536));
    return address;
  }

  put(bytes) {
    const address = this.space(bytes.length);
    this.at(address, bytes.length, Uint8Array).set(bytes);
    return address;
  }

  pointers(...addresses) {
    return this.put(new Uint8Array(Uint32Array.from(addresses).buffer));
  }

  at(address, count, Kind = Float64Array) {
    return new Kind(this.calls.memory.buffer, address, count);
  }
}
/* The flight that the native engine flew too: engine_fly with the same records and random numbers. */
const TRACE_AXES = [3, 3, 3, 2, 1, 1, 3, 3, 3];
const TARGET_PLACE = 3; /* in a trace, the target follows position, velocity and angles */

async function sha256(parts) {
  const whole = new Uint8Array(await new Blob(parts).arrayBuffer());
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", whole));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/* The digest of the trace of one controller's flight, as Trace.digest computes it. */
async function traceDigest(entry, data) {
  const module = await Module.load(entry), { proof } = data, { updates } = proof;
  const times = Float64Array.from({ length: updates }, (_, update) => data.period_s * update);
  const [simulation, flight, sensors, gusts] =
    ["simulation", "flight", "sensors", "gusts"].map((name) => module.put(bytesOf(proof[name])));
  const targets = new Float64Array(bytesOf(proof.targets).buffer), columns = targets.length / updates;
  module.at(simulation + data.offsets.simulation.commands_thrust, 1, BigInt64Array)[0] = BigInt(entry.commands_thrust);
  const arrays = TRACE_AXES.map((axes) => module.space(8 * axes * updates));
  module.calls.engine_fly(
    simulation, flight, 0n, module.put(new Uint8Array(times.buffer)), module.put(new Uint8Array(targets.buffer)),
    module.pointers(sensors, gusts, 0), module.step, module.self, 0n, module.pointers(...arrays),
  );
  const parts = arrays.map((address, place) => module.at(address, TRACE_AXES[place] * updates));
  parts.splice(TARGET_PLACE, 0, targets.filter((_, index) => data.columns.traced.includes(index % columns)));
  return sha256([times, ...parts]);
}

/* The digests in this browser, in the order of the drones; an error's message where a module fails. */
function proveAll(data) {
  return Promise.all(data.drones.map((entry) => traceDigest(entry, data).catch((error) => String(error))));
}
