/* The target, with its height: on a curve, on a plan, or where it was dragged: far away at once, else with a speed and an acceleration that drones have. */
const SPEED_M_S = 2, ACCELERATION_M_S2 = 2.5, APPROACH_1_S = 1.25, ADJUST_1_S = 5, REACH_M = 30, FAR_M = 4;

/* Shortens a vector to a length; without Math.hypot, which may differ between browsers. */
function atMost(length, [x, y]) {
  const size = Math.sqrt(x * x + y * y);
  return size > length ? [x * length / size, y * length / size] : [x, y];
}

class Target {
  /* The curves are computed in the module of a drone. Its height swings about `height` by `swing`, in m. */
  constructor(drone, data) {
    Object.assign(this, { drone, data, kind: data.first, goal: [0, 0], height: data.height_m, swing: 0, haste: 1, lead: 0 });
    this.now = new Float64Array(data.columns.target);
  }

  /* Stands at its goal, or at the beginning of its curve. */
  begin() {
    this.lead = 0;
    this.stand(...this.goal);
    this.at(0);
    if (this.kind !== "hand") this.goal = [this.now[0], this.now[1]];
  }

  /* Moves to its place at a time; on a curve it knows the acceleration ahead, where it is dragged that of now. */
  at(time) {
    const { now, kind, data: { columns, curves, swing_rad_s, ahead_s, spatial } } = this;
    const flown = kind === "plan" ? [0, ahead_s].map((ahead) => this.planned(time + this.lead + ahead)) : null;
    if (flown) now.set([...flown[0].slice(0, 6), ...flown[1].slice(4, 6)]);
    else if (kind !== "hand") {
      const [size, rate] = curves[kind];
      const [place, later] = [0, ahead_s].map((ahead) => this.computed(kind, 6, size, rate * this.haste, time + this.lead + ahead));
      now.set([...place, ...later.slice(4)]);
    }
    const [height, later] = flown && spatial ? flown.map((motion) => motion.slice(6)) : [0, ahead_s].map((ahead) => this.computed("swing", 3, this.height, this.swing, swing_rad_s, time + ahead));
    now.set([...height, later[2]], columns.level);
    now[columns.known] = kind === "hand" ? 1 : 2;
    return now;
  }

  /* What a function of the module computes: x, y, vx, vy, ax, ay of a curve, or height, climb and its acceleration. */
  computed(name, count, ...values) {
    const { module, curve } = this.drone;
    module.calls[`playground_${name}`](...values, curve);
    return Array.from(module.at(curve, count));
  }

  /* The plan: x, y, vx, vy, ax, ay, and height, climb and its acceleration; operation by operation Pieces of sil/mambo_sil/flight/polynomials.py. */
  planned(time) {
    const { ends, axes, repeats } = this.data.plan, haste = this.haste, last = ends.at(-1);
    const clock = repeats ? haste * time % last : Math.min(haste * time, last);
    const moves = clock < last, piece = moves ? ends.findIndex((end) => clock < end) : ends.length - 1;
    const since = clock - (piece ? ends[piece - 1] : 0);
    const [x, y, height] = axes.map((pieces) => [0, 1, 2].map((order) => {
      if (order && !moves) return 0;
      const value = pieces[piece].reduceRight((sum, coefficient, power) => {
        return power < order ? sum : sum * since + [1, power, power * (power - 1)][order] * coefficient;
      }, 0);
      return haste ** order * value;
    }));
    return [...x.flatMap((value, order) => [value, y[order]]), ...height];
  }

  /* Rests at a place. */
  stand(x, y) {
    this.now.set([x, y, 0, 0, 0, 0]);
  }

  /* Follows its curve so many times as fast from a time on, from where it is. */
  hasten(haste, time) {
    this.lead = this.haste / haste * (time + this.lead) - time;
    this.haste = haste;
  }

  /* Follows its goal for a period, if it is dragged. */
  move() {
    if (this.kind !== "hand") return;
    const [x, y, vx, vy, ax, ay] = this.now, h = this.data.period_s;
    const [px, py, ux, uy] = [x + h * vx + h * h / 2 * ax, y + h * vy + h * h / 2 * ay, vx + h * ax, vy + h * ay];
    const wanted = atMost(SPEED_M_S, [APPROACH_1_S * (this.goal[0] - px), APPROACH_1_S * (this.goal[1] - py)]);
    const change = atMost(ACCELERATION_M_S2, [ADJUST_1_S * (wanted[0] - ux), ADJUST_1_S * (wanted[1] - uy)]);
    this.now.set([px, py, ux, uy, ...change]);
  }

  drag(x, y) {
    this.kind = "hand";
    this.goal = [x, y].map((value) => Math.min(Math.max(value, -REACH_M), REACH_M));
  }

  /* When the pointer leaves it: stands at a goal that is far at once; glides to one that is near. */
  release() {
    const [x, y] = this.goal;
    if (Math.abs(x - this.now[0]) > FAR_M || Math.abs(y - this.now[1]) > FAR_M) this.stand(x, y);
  }
}
