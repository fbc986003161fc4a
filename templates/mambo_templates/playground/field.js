/* The field seen from above: target, trails and drones. A line from each drone shows where, and how much, it tilts. */
const VIEW_M = 5.6, TRAIL_S = 3, RADIUS_PX = 10, TILT_M_RAD = 1.6, EDGE_PX = 14;

/* Resizes a canvas to its place on the page; returns its context, in CSS pixels, and its size. */
function fit(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas, ratio = devicePixelRatio;
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
  constructor(canvas, world) {
    Object.assign(this, { canvas, world, arrow: null });
  }

  get scale() {
    return this.canvas.clientWidth / VIEW_M;
  }

  /* From pixels of the canvas to m. */
  metres(x, y) {
    return [(x - this.canvas.clientWidth / 2) / this.scale, (y - this.canvas.clientHeight / 2) / this.scale];
  }

  pixels(x, y) {
    return [x * this.scale + this.canvas.clientWidth / 2, y * this.scale + this.canvas.clientHeight / 2];
  }

  draw(palette) {
    const [context, width, height] = fit(this.canvas), { world } = this, rows = world.drawn, now = rows.at(-1);
    context.lineJoin = context.lineCap = "round";
    this.grid(context, width, height, palette);
    this.wind(context, palette);
    const stroke = (points, colour, thickness, dash = []) => {
      Object.assign(context, { strokeStyle: colour, lineWidth: thickness });
      context.setLineDash(dash);
      context.beginPath();
      points.forEach(([x, y]) => context.lineTo(...this.pixels(x, y)));
      context.stroke();
    };
    stroke(rows.map((row) => [row[1], row[2]]), palette.target, 4);
    this.target(context, palette, now);
    const recent = rows.filter((row) => row[0] > now[0] - TRAIL_S);
    const shown = world.drones.map((drone, index) => index).filter((index) => world.drones[index].shown).reverse();
    for (const index of shown) { /* the first one on top */
      const first = 3 + PER_DRONE * index, colour = palette.hues[world.drones[index].entry.hue];
      stroke(recent.filter((row) => Number.isFinite(row[first])).map((row) => [row[first], row[first + 1]]), colour, 1.5);
    }
    for (const index of shown) this.drone(context, palette, now, index, stroke);
    if (this.arrow) stroke(this.arrow, palette.ink, 2.5, [2, 5]);
  }

  grid(context, width, height, palette) {
    Object.assign(context, { strokeStyle: palette.line, lineWidth: 1, fillStyle: palette.quiet, font: "12px system-ui, sans-serif" });
    context.setLineDash([]);
    context.beginPath();
    for (let metre = -4; metre <= 4; metre++) {
      const [x, y] = this.pixels(metre, metre);
      context.moveTo(x, 0);
      context.lineTo(x, height);
      context.moveTo(0, y);
      context.lineTo(width, y);
    }
    context.stroke();
    context.fillText("grid 1 m", 8, height - 8);
  }

  /* An arrow with the mean wind, in the upper left corner. */
  wind(context, palette) {
    const { dials } = this.world.data, value = (key) => {
      const index = dials.findIndex((dial) => dial.key === key);
      return dials[index].values[this.world.dials[index]];
    };
    const speed = value("wind"), way = value("towards") * Math.PI / 180, length = 8 + speed;
    if (!speed) return;
    const end = (angle, size) => [30 + size * Math.cos(way + angle), 30 + size * Math.sin(way + angle)];
    Object.assign(context, { strokeStyle: palette.ink, lineWidth: 2, fillStyle: palette.ink });
    context.setLineDash([]);
    context.beginPath();
    [end(Math.PI, length), end(0, length)].forEach((point) => context.lineTo(...point));
    [end(0.5, length - 7), end(0, length), end(-0.5, length - 7)].forEach((point, place) =>
      (place ? context.lineTo(...point) : context.moveTo(...point)));
    context.stroke();
    context.fillText(`wind ${speed} m/s`, 56, 34);
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

  /* A disc with the number of the table; at the edge of the field if the drone is beyond it. */
  drone(context, palette, now, index, stroke) {
    const [x, y, roll, pitch] = now.slice(3 + PER_DRONE * index, 3 + PER_DRONE * (index + 1));
    if (!Number.isFinite(x)) return;
    const colour = palette.hues[this.world.drones[index].entry.hue];
    stroke([[x, y], [x - TILT_M_RAD * Math.sin(pitch), y + TILT_M_RAD * Math.sin(roll)]], colour, 3);
    const inside = (value, size) => Math.min(Math.max(value, EDGE_PX), size - EDGE_PX);
    const [px, py] = this.pixels(x, y);
    const [cx, cy] = [inside(px, this.canvas.clientWidth), inside(py, this.canvas.clientHeight)];
    Object.assign(context, { fillStyle: colour, strokeStyle: palette.paper, lineWidth: 1.5, font: "bold 12px system-ui, sans-serif" });
    context.beginPath();
    context.arc(cx, cy, RADIUS_PX, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
    Object.assign(context, { fillStyle: palette.paper, textAlign: "center", textBaseline: "middle" });
    context.fillText(index + 1, cx, cy + 0.5);
    Object.assign(context, { textAlign: "start", textBaseline: "alphabetic" });
  }
}
