/* What the field shows: all that is near the start, or target, fence and drones that are not lost, wherever they are. */
const VIEW_M = 5.6, MOST_VIEW_M = 80, MARGIN = 1.3, INSET_M = 0.07, EASE_1_S = 3, ZOOM_1_S = 1.5, BAND_PX = 28;

class View {
  constructor(canvas, world) {
    Object.assign(this, { canvas, world, centre: [0, 0], width: VIEW_M });
  }

  /* Pixels per m. */
  get scale() {
    return this.canvas.clientWidth / this.width;
  }

  /* From pixels of the canvas to m. */
  metres(x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.centre[0] + (x - clientWidth / 2) / this.scale, this.centre[1] + (y - clientHeight / 2) / this.scale];
  }

  pixels(x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    return [(x - this.centre[0]) * this.scale + clientWidth / 2, (y - this.centre[1]) * this.scale + clientHeight / 2];
  }

  /* Centre and width, in m, that hold all there is to see. */
  get wanted() {
    const { world, canvas } = this, now = world.history.at(-1), { target, fence } = world;
    const points = [[now[1], now[2]], [target.now[0], target.now[1]]];
    if (target.kind === "hand") points.push(target.goal);
    if (fence) points.push(fence.slice(0, 2), fence.slice(2));
    world.drones.forEach((drone, index) => {
      const first = FIRST + PER_DRONE * index;
      if (drone.shown && !drone.lost) points.push([now[first], now[first + 1]]);
    });
    const aspect = canvas.clientHeight / canvas.clientWidth, home = [VIEW_M / 2, VIEW_M / 2 * aspect];
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
    if (!this.canvas.clientWidth) return;
    const { centre, width } = this.wanted, share = 1 - Math.exp(-EASE_1_S * seconds);
    this.centre = this.centre.map((value, axis) => value + share * (centre[axis] - value));
    this.width *= (width / this.width) ** share;
  }

  /* Zooms out while a pointer is held at the edge or beyond it. */
  widen(seconds, x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    const inside = Math.min(x, y, clientWidth - x, clientHeight - y);
    if (inside < BAND_PX) this.width = Math.max(this.width, Math.min(MOST_VIEW_M, this.width * Math.exp(ZOOM_1_S * seconds)));
  }
}
