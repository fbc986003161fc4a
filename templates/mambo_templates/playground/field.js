/* The field seen from above: target, trails and drones. A line from each drone shows where, and how much, it tilts. */
const TRAIL_S = 3, TILT_M_RAD = 1.6, GRIDS_M = [1, 2, 5, 10, 20], GRID_PX = 48;
const MOST_RATIO = 2; /* pixels of a canvas per CSS pixel: more are slow, and not seen */

/* Resizes a canvas to its place on the page; returns its context, in CSS pixels, and its size. */
function fit(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas, ratio = Math.min(devicePixelRatio, MOST_RATIO);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width, height];
}

/* The colours of the page, light or dark; drones in the order of the table. */
function colours() {
  const style = getComputedStyle(document.documentElement);
  const hues = ["--flown", "--other", "--good", "--fourth"].map((name) => style.getPropertyValue(name));
  const [ink, quiet, line, paper, target] =
    ["--ink", "--quiet", "--line", "--paper", "--target"].map((name) => style.getPropertyValue(name));
  return { hues, ink, quiet, line, paper, target };
}

class Field {
  /* What the pointer draws: `arrow` of a push, `corners` of a fence, which it does after `drawing`. */
  constructor(canvas, world) {
    Object.assign(this, { canvas, world, view: new View(canvas, world), arrow: null, corners: null, drawing: false, held: false });
  }

  pixels(x, y) {
    return this.view.pixels(x, y);
  }

  /* Follows what there is to see, unless a pointer is on the field. */
  follow(seconds) {
    if (!this.held) this.view.follow(seconds);
  }

  draw(palette) {
    const [context, width, height] = fit(this.canvas), { world } = this, rows = world.drawn;
    this.view.measure();
    const shown = world.drones.map((drone, index) => index).filter((index) => world.drones[index].shown).reverse();
    context.lineJoin = context.lineCap = "round";
    this.grid(context, width, height, palette);
    drawStreaks(context, palette, this, width, height);
    this.aims(context, palette, rows);
    const words = this.drones(context, palette, rows, shown);
    drawInset(context, palette, this, rows, shown);
    labels(context, palette, this.canvas, words);
    if (this.arrow) this.stroke(context, this.arrow, palette.ink, 2.5, [2, 5]);
  }

  stroke(context, points, strokeStyle, lineWidth, dash = []) {
    Object.assign(context, { strokeStyle, lineWidth });
    context.setLineDash(dash);
    context.beginPath();
    points.forEach(([x, y]) => context.lineTo(...this.pixels(x, y)));
    context.stroke();
  }

  /* The target with its trail and the place that it glides to, and the fence. */
  aims(context, palette, rows) {
    const now = rows.at(-1), { target, fence, data: { plan } } = this.world, corners = this.corners ?? (fence && [fence.slice(0, 2), fence.slice(2)]);
    if (target.kind === "plan") this.stroke(context, plan.path, palette.quiet, 1.5, [2, 6]);
    this.stroke(context, rows.map((row) => [row[1], row[2]]), palette.target, 4);
    this.target(context, palette, now);
    if (corners) {
      const [[x, y], [u, v]] = corners;
      this.stroke(context, [[x, y], [u, y], [u, v], [x, v], [x, y]], palette.ink, 2, [8, 6]);
    }
    if (target.kind === "hand" && (this.held || target.goal.some((value, axis) => Math.abs(value - now[1 + axis]) > 0.05))) {
      this.stroke(context, [[now[1], now[2]], target.goal], palette.quiet, 1.5, [2, 6]);
    }
  }

  /* Trails and drones, the first on top and with the wind at it; returns the words beside them. */
  drones(context, palette, rows, shown) {
    const { world } = this, now = rows.at(-1), recent = rows.filter((row) => row[0] > now[0] - TRAIL_S);
    for (const index of shown) {
      const first = FIRST + PER_DRONE * index, colour = palette.hues[world.drones[index].entry.hue];
      this.stroke(context, recent.filter((row) => Number.isFinite(row[first])).map((row) => [row[first], row[first + 1]]), colour, 1.5);
    }
    const words = shown.map((index) => this.drone(context, palette, now, index)).reverse();
    const flying = words.find((one) => !one.lost);
    if (flying && windSpeed(world)) words.push(windArrow(context, palette, world, flying.place));
    return words;
  }

  grid(context, width, height, palette) {
    Object.assign(context, { strokeStyle: palette.line, lineWidth: 1, fillStyle: palette.quiet, font: "12px system-ui, sans-serif" });
    context.setLineDash([]);
    context.beginPath();
    const { scale } = this.view, step = GRIDS_M.find((one) => one * scale >= GRID_PX) ?? GRIDS_M.at(-1);
    const [left, top] = this.view.metres(0, 0).map((value) => Math.ceil(value / step) * step);
    for (let metre = left; this.pixels(metre, 0)[0] < width; metre += step) {
      context.moveTo(this.pixels(metre, 0)[0], 0);
      context.lineTo(this.pixels(metre, 0)[0], height);
    }
    for (let metre = top; this.pixels(0, metre)[1] < height; metre += step) {
      context.moveTo(0, this.pixels(0, metre)[1]);
      context.lineTo(width, this.pixels(0, metre)[1]);
    }
    context.stroke();
    this.bar(context, height, palette, step);
  }

  /* The scale bar, one step of the grid long, in the lower left corner. */
  bar(context, height, palette, step) {
    const [left, y, right] = [10, height - 12, 10 + step * this.view.scale];
    Object.assign(context, { strokeStyle: palette.ink, fillStyle: palette.ink, lineWidth: 2 });
    context.beginPath();
    [[left, y - 5], [left, y], [right, y], [right, y - 5]].forEach((point) => context.lineTo(...point));
    context.stroke();
    context.fillText(`${step} m`, left + 4, y - 5);
  }

  target(context, palette, now) {
    const [x, y] = this.pixels(now[1], now[2]);
    Object.assign(context, { strokeStyle: palette.ink, lineWidth: 2 });
    context.setLineDash([]);
    context.beginPath();
    context.arc(x, y, 17, 0, 2 * Math.PI);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + 12 * dx, y + 12 * dy);
      context.lineTo(x + 22 * dx, y + 22 * dy);
    }
    context.stroke();
  }

  /* A quadrotor, at the edge of the field if it is beyond it; a cross where it was lost. Returns what to say beside it. */
  drone(context, palette, now, index) {
    const [x, y, , ...angles] = stateOf(now, index), one = this.world.drones[index], { title, hue } = one.entry;
    const colour = palette.hues[hue], place = inside(this.canvas, this.pixels(...(one.lost ? one.lost.place : [x, y])));
    if (one.lost) {
      cross(context, colour, place);
      return { words: `${title} is lost: ${one.lost.why}`, colour, place, lost: true };
    }
    const length = TILT_M_RAD * this.view.width / VIEW_M, [roll, pitch] = angles;
    this.stroke(context, [[x, y], [x - length * Math.sin(pitch), y + length * Math.sin(roll)]], colour, 3);
    quadrotor(context, palette, colour, index + 1, place, angles);
    return { words: one.active.length ? `${title} ${one.speedWords}` : title, colour, place };
  }
}
