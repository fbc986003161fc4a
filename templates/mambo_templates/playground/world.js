/* All drones with one target, one wind and one clock. The same scenario flies the same bits in every browser. */
const HISTORY_S = 10, IMPULSE_N_S = 0.04, LOST_M = 50, LOST_S = 3;

/* Numbers in [0, 1) from a seed of 32 bits (mulberry32); the sum of twelve less 6 is nearly normal, and exact. */
function normals(seed) {
  let state = seed;
  function uniform() {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  }
  return (count) => Float64Array.from({ length: count }, () => {
    let sum = -6;
    for (let n = 0; n < 12; n++) sum += uniform();
    return sum;
  });
}

class World {
  constructor(drones, data) {
    Object.assign(this, { drones, data, fence: null, dials: data.dials.map((dial) => dial.start) });
    this.target = new Target(drones[0], data);
    this.begin();
  }

  begin() {
    Object.assign(this, { updates: 0, history: [], impulse: null, draw: normals(1) });
    this.aim();
    this.target.begin();
    this.first = [...this.draw(3), ...new Float64Array(3 * this.data.ticks)];
    this.drones.forEach((drone) => { drone.losses = 0; this.start(drone); });
    this.record();
  }

  /* Puts a drone at the target, at rest, with all that the sliders and the fence say. */
  start(drone) {
    Object.assign(drone, { lost: null, born: this.updates });
    drone.begin(this.target.now, this.first);
    this.dials.forEach((place, index) => this.apply(drone, this.data.dials[index], place));
    if (drone.limited) drone.enclose(this.fence);
  }

  /* Sets a slider. */
  turn(index, place) {
    this.dials[index] = place;
    this.aim();
    this.drones.forEach((drone) => this.apply(drone, this.data.dials[index], place));
  }

  /* What a slider says. */
  value(key) {
    const index = this.data.dials.findIndex((dial) => dial.key === key);
    return this.data.dials[index].values[this.dials[index]];
  }

  /* Gives the target the speed, and on a page with heights the height, that the sliders say. */
  aim() {
    this.target.hasten(this.value("speed"), this.time);
    if (this.data.spatial) Object.assign(this.target, { height: this.value("height"), swing: this.value("swing") });
  }

  /* Gives one drone what a slider says, if the slider is for it. */
  apply(drone, dial, place) {
    if (dial.drone !== null) {
      if (this.drones[dial.drone] === drone) drone.setWeights(dial.members.weights[place]);
      return;
    }
    const rows = Object.entries(dial.members).map(([member, values]) => [member, values[place]]);
    drone.setMembers("flight", Object.fromEntries(rows));
    if (dial.key === "noise") drone.sense(dial.values[place] > 0);
  }

  /* Puts a fence (least x and y, largest x and y, in m; null: none) around those that have limits; tells who has it not. */
  enclose(fence) {
    const { drones } = this, without = drones.filter((drone) => !drone.limited);
    this.fence = fence;
    const refused = drones.filter((drone) => drone.limited && !drone.enclose(fence));
    return [
      ...(without.length ? [`Without limits, so without a fence: ${titles(without)}.`] : []),
      ...(refused.length ? [`Refused by ${titles(refused)}.`] : []),
    ].join(" ");
  }

  /* Pushes every drone with the same impulse, in N s, at the next update. */
  push(impulse) {
    this.impulse = impulse;
  }

  get time() {
    return this.updates * this.data.period_s;
  }

  advance(updates) {
    for (let n = 0; n < updates; n++) {
      const target = this.target.at(this.time), { ticks } = this.data;
      const draws = [this.draw(6 * ticks), this.draw(3 * (ticks + 1))];
      for (const drone of this.drones) {
        if (drone.lost && this.time >= drone.lost.until) this.start(drone);
        if (drone.lost) continue;
        if (this.impulse) drone.push(this.impulse, (this.updates - drone.born) * ticks);
        drone.update([this.time], target, ...draws);
        this.watch(drone, target);
      }
      this.impulse = null;
      this.record();
      this.updates++;
      this.target.move();
    }
  }

  /* Takes a drone that is lost out of the flight: it stays where it was, and starts again after LOST_S. */
  watch(drone, target) {
    const [x, y, z] = drone.position, [roll, pitch] = drone.angles;
    const why = Math.cos(roll) * Math.cos(pitch) < 0 ? "it turned over"
      : z >= 0 ? "it hit the ground"
      : Math.hypot(x - target[0], y - target[1], z + target[this.data.columns.level]) < LOST_M ? null : `it is more than ${LOST_M} m from the target`;
    if (!why) return;
    drone.losses++;
    drone.lost = { why, place: drone.last, until: this.time + LOST_S };
  }

  /* Of a row of the history, the distance of a drone to the target in m: horizontal, and vertical (0 if no controller commands the height). */
  errors(row, drone) {
    const first = FIRST + PER_DRONE * drone, above = this.data.spatial ? row[first + 2] - row[3] : 0;
    return [Math.hypot(row[first] - row[1], row[first + 1] - row[2]), Math.abs(above)];
  }

  /* The whole distance. */
  error(row, drone) {
    return Math.hypot(...this.errors(row, drone));
  }

  /* The rows that are drawn: every fourth, the same ones from picture to picture, and the last. */
  get drawn() {
    const last = this.history.length - 1, first = this.updates - last;
    return this.history.filter((_, place) => (first + place) % 4 === 0 || place === last);
  }

  /* Keeps the last seconds for trails and plots: time, target, and of each drone x, y, height, roll, pitch, yaw. */
  record() {
    const { now } = this.target;
    const states = this.drones.flatMap((drone) => {
      if (drone.lost) return Array(PER_DRONE).fill(NaN);
      const { position: [x, y, z], angles } = drone;
      drone.last = [x, y];
      return [x, y, -z, ...angles];
    });
    this.history.push([this.time, now[0], now[1], now[this.data.columns.level], ...states]);
    if (this.history.length > HISTORY_S / this.data.period_s) this.history.shift();
  }
}

const FIRST = 4, PER_DRONE = 6;

/* Of a row of the history: x, y, height, roll, pitch and yaw of a drone; all NaN if it is lost. */
const stateOf = (row, drone) => row.slice(FIRST + PER_DRONE * drone, FIRST + PER_DRONE * (drone + 1));

/* Its tilt in degrees. */
const tiltOf = (row, drone) => {
  const first = FIRST + PER_DRONE * drone, [roll, pitch] = [row[first + 3], row[first + 4]];
  return Math.acos(Math.cos(roll) * Math.cos(pitch)) * 180 / Math.PI;
};
/* The scenario in the fragment of the address: what differs from the page's start. */
const CURVES = ["plan", "eight", "circle"];

function fragmentOf(world) {
  const words = new URLSearchParams(), { target, data } = world;
  if (target.kind !== data.first) words.set("target", target.kind);
  if (target.kind === "hand") words.set("at", target.goal.map((value) => value.toFixed(2)).join(","));
  data.dials.forEach((dial, index) => {
    if (world.dials[index] !== dial.start) words.set(dial.key, dial.values[world.dials[index]]);
  });
  if (world.fence) words.set("fence", world.fence.join(","));
  const hidden = world.drones.flatMap((drone, index) => (drone.shown ? [] : [index + 1]));
  if (hidden.length) words.set("without", hidden.join(","));
  return words.toString();
}

/* Starts the world anew as a fragment says; what it does not understand it leaves at the start. */
function restore(world, fragment) {
  const words = new URLSearchParams(fragment), { target, data } = world;
  const at = (words.get("at") || "0,0").split(",").map(Number);
  const named = words.get("target");
  target.kind = data.first;
  target.goal = [0, 0];
  if (named === "hand" && at.length === 2 && at.every(Number.isFinite)) target.drag(...at);
  else if (CURVES.includes(named) && (named !== "plan" || data.plan)) target.kind = named;
  const fence = (words.get("fence") || "").split(",").map(Number), [left, top, right, bottom] = fence;
  const good = fence.length === 4 && fence.every((value) => Math.abs(value) <= MOST_VIEW_M) && left < right && top < bottom;
  world.fence = good ? fence : null;
  world.dials = data.dials.map((dial) => {
    const place = words.has(dial.key) ? dial.values.indexOf(Number(words.get(dial.key))) : -1;
    return place < 0 ? dial.start : place;
  });
  const hidden = (words.get("without") || "").split(",").map(Number);
  world.drones.forEach((drone, index) => { drone.shown = !hidden.includes(index + 1); });
  world.begin();
}
