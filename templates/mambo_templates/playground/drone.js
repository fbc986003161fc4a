/* One drone on the field: a module and its flight, update by update. */
const LIMIT_NAMES = ["speed", "braking", "fence", "tilt", "height", "thrust"]; /* the bits of nmpc_limits_active */
const KINDS = { float32: Float32Array, float64: Float64Array, fixed: Int32Array };

class Drone {
  constructor(module, entry, data) {
    Object.assign(this, { module, entry, offsets: data.offsets, columns: data.columns, places: data.limits, real: KINDS[entry.scalar], shown: true });
    this.simulation = module.put(bytesOf(data.simulation));
    this.flight = module.put(bytesOf(data.flight));
    this.flying = module.space(module.calls.playground_flying_bytes());
    [this.time, this.target, this.sensors, this.gusts] =
      [8, 8 * data.columns.target, 48 * data.ticks, 24 * (data.ticks + 1)].map((size) => module.space(size));
    this.draws = module.pointers(this.sensors, this.gusts, 0);
    const arrays = TRACE_AXES.map((axes) => module.space(8 * axes));
    this.trace = module.pointers(...arrays);
    this.weights = module.space(2 * this.real.BYTES_PER_ELEMENT);
    this.limits = module.space(this.places.count * this.real.BYTES_PER_ELEMENT);
    this.status = module.space(4);
    this.curve = module.space(48);
    /* What is read and written at every update; memory must not grow from here on. */
    [this.position, this.velocity, this.angles] = arrays.slice(0, 3).map((address) => module.at(address, 3));
    this.answer = module.at(arrays[5], 1, BigInt64Array);
    this.inputs = [this.time, this.target, this.sensors, this.gusts].map((address, index) =>
      module.at(address, [1, data.columns.target, 6 * data.ticks, 3 * (data.ticks + 1)][index]));
    const flies = { disturbed: [1], windy: [1], sensed: [0], captured: [0], commands_thrust: [entry.commands_thrust] };
    this.setMembers("simulation", flies, BigInt64Array);
  }

  setMembers(record, members, Kind = Float64Array) {
    for (const [member, numbers] of Object.entries(members)) {
      const address = this[record] + this.offsets[record][member];
      this.module.at(address, numbers.length, Kind).set(Kind === BigInt64Array ? numbers.map(BigInt) : numbers);
    }
  }

  setWeights(weights) {
    this.module.at(this.weights, 2, this.real).set(weights);
    this.module.calls.nmpc_host_set_weights(this.module.self, 1, this.weights, this.status);
  }

  get limited() {
    return this.entry.metre !== null;
  }

  /* Replaces the fence, in m, least x and y, largest x and y, null by the settings' fence; returns whether the controller takes it. */
  enclose(fence) {
    const { calls, self } = this.module, numbers = this.module.at(this.limits, this.places.count, this.real);
    calls.nmpc_default_limits(this.limits);
    if (fence) numbers.set(fence.map((value) => value * this.entry.metre), this.places.fence);
    calls.nmpc_host_set_limits(self, 1, this.limits, this.status);
    return this.module.at(this.status, 1, Int32Array)[0] === 0;
  }

  /* The names of the limits that act. */
  get active() {
    if (!this.limited) return [];
    this.module.calls.nmpc_host_limits_active(this.module.self, 1, this.status);
    const bits = this.module.at(this.status, 1, Int32Array)[0];
    return LIMIT_NAMES.filter((_, place) => bits >> place & 1);
  }

  /* Speed, and which limits act. */
  get speedWords() {
    const { active } = this, speed = `${Math.hypot(this.velocity[0], this.velocity[1]).toFixed(1)} m/s`;
    return active.length ? `${speed}, limit: ${active.join(", ")}` : speed;
  }

  /* With sensors from now on, or with the true state. */
  sense(sensed) {
    const members = { sensed: [Number(sensed)], captured: [Number(sensed)] };
    this.setMembers("simulation", members, BigInt64Array);
    if (sensed && !this.sensed) this.module.calls.engine_start_sensors(this.simulation, this.flying);
    this.sensed = sensed;
  }

  /* Hovers above the target; `draws` starts the gusts. */
  begin(target, draws) {
    this.module.reset();
    this.sensed = false;
    this.setMembers("flight", { body_start: [target[0], target[1], -target[this.columns.level]] });
    this.setMembers("flight", { impulse_tick: [-1] }, BigInt64Array);
    this.inputs[3].set(draws);
    this.position.set([target[0], target[1], -target[this.columns.level]]);
    this.velocity.fill(0);
    this.angles.fill(0);
    this.module.calls.engine_begin(this.simulation, this.flight, this.draws, this.flying);
  }

  push(impulse, tick) {
    this.setMembers("flight", { impulse_n_s: [...impulse, 0] });
    this.setMembers("flight", { impulse_tick: [tick] }, BigInt64Array);
  }

  update(...inputs) {
    this.inputs.forEach((place, index) => place.set(inputs[index]));
    this.module.calls.engine_update(
      this.simulation, this.flight, 0n, 0n, this.time, this.target, this.draws, this.module.step, this.module.self, 0n,
      this.flying, this.trace,
    );
  }
}
