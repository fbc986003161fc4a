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
