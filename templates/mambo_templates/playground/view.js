/* What the field shows: all that is near the start, or target, fence and drones that are not lost, wherever they are. */
const VIEW_M = 5.6, MOST_VIEW_M = 80, MARGIN = 1.3, INSET_M = 0.07, EASE_1_S = 3, ZOOM_1_S = 1.5, BAND_PX = 28;

class View {
  constructor(canvas, world) {
    Object.assign(this, { canvas, world, centre: [0, 0], width: VIEW_M });
    this.measure();
  }

  /* Reads the size of the canvas, in pixels: once a picture, for it takes time. */
  measure() {
    this.size = [this.canvas.clientWidth, this.canvas.clientHeight];
  }

  /* Pixels per m. */
  get scale() {
    return this.size[0] / this.width;
  }

  /* From pixels of the canvas to m. */
  metres(x, y) {
    const { scale, size, centre } = this;
    return [centre[0] + (x - size[0] / 2) / scale, centre[1] + (y - size[1] / 2) / scale];
  }

  pixels(x, y) {
    const { scale, size, centre } = this;
    return [(x - centre[0]) * scale + size[0] / 2, (y - centre[1]) * scale + size[1] / 2];
  }

  /* Centre and width, in m, that hold all there is to see. */
  get wanted() {
    const { world, size } = this, now = world.history.at(-1), { target, fence } = world;
    const points = [[now[1], now[2]], [target.now[0], target.now[1]]];
    if (target.kind === "hand") points.push(target.goal);
    if (target.kind === "plan") points.push(...world.data.plan.path);
    if (fence) points.push(fence.slice(0, 2), fence.slice(2));
    world.drones.forEach((drone, index) => {
      const first = FIRST + PER_DRONE * index;
      if (drone.shown && !drone.lost) points.push([now[first], now[first + 1]]);
    });
    const aspect = size[1] / size[0], home = [VIEW_M / 2, VIEW_M / 2 * aspect];
    if (points.every((point) => point.every((value, axis) => Math.abs(value) <= home[axis] - INSET_M))) {
      return { centre: [0, 0], width: VIEW_M };
    }
    const ends = [0, 1].map((axis) => points.map((point) => point[axis])).map((all) => [Math.min(...all), Math.max(...all)]);
    const [across, down] = ends.map(([least, most]) => most - least);
    return {
      centre: ends.map(([least, most]) => (least + most) / 2),
      width: Math.max(VIEW_M, MARGIN * across, MARGIN * down / aspect),
    };
  }

  /* Approaches what is wanted for some time; Infinity: is there at once. A page that is hidden has no size. */
  follow(seconds) {
    this.measure();
    if (!this.size[0]) return;
    const { centre, width } = this.wanted, share = 1 - Math.exp(-EASE_1_S * seconds);
    this.centre = this.centre.map((value, axis) => value + share * (centre[axis] - value));
    this.width *= (width / this.width) ** share;
  }

  /* Zooms out while a pointer is held at the edge or beyond it. */
  widen(seconds, x, y) {
    const inside = Math.min(x, y, this.size[0] - x, this.size[1] - y);
    if (inside < BAND_PX) this.width = Math.max(this.width, Math.min(MOST_VIEW_M, this.width * Math.exp(ZOOM_1_S * seconds)));
  }
}
