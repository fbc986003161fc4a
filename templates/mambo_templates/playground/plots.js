/* Plots over the last seconds; each drone has its colour and its dashes. The axes stay: a larger value is at the upper edge. */
const LEFT_PX = 40, BOTTOM_PX = 20, TOP_PX = 6;

/* Vertical axes: the marks, and where a value is, from 0 at the lower end to 1 at the upper. */
const LOGARITHMIC_CM = { marks: [0.1, 1, 10, 100, 1000], share: (value) => (Math.log10(Math.max(value, 0.1)) + 1) / 4 };
const HEIGHT_M = { marks: [0, 1, 2, 3, 4], share: (value) => value / 4 };
const DEGREES = { marks: [0, 20, 40], share: (value) => value / 40 };

class Plot {
  /* `value` of a row and a drone; `goal`, if there is one, of a row: where all drones are to be. */
  constructor(canvas, world, value, axis, goal = null) {
    Object.assign(this, { canvas, world, value, axis, goal, palette: null, seen: true });
    new IntersectionObserver(([{ isIntersecting }]) => {
      this.seen = isIntersecting;
      if (this.palette) this.draw(this.palette);
    }).observe(canvas);
  }

  /* Draws, if it is in the window; else when it comes there. */
  draw(palette) {
    this.palette = palette;
    if (!this.seen) return;
    const [context, width, height] = fit(this.canvas), { drawn: rows, drones } = this.world;
    const bottom = height - BOTTOM_PX, last = rows.at(-1)[0], first = Math.max(last, HISTORY_S) - HISTORY_S;
    const shown = drones.map((drone, index) => index).filter((index) => drones[index].shown).reverse();
    const lines = shown.map((index) => [index, rows.map((row) => this.value(row, index))]);
    const x = (time) => LEFT_PX + (time - first) / HISTORY_S * (width - LEFT_PX - 2);
    const y = (value) => bottom - Math.min(Math.max(this.axis.share(value), 0), 1) * (bottom - TOP_PX);
    Object.assign(context, { strokeStyle: palette.line, fillStyle: palette.quiet, lineWidth: 1, font: "12px system-ui, sans-serif", textAlign: "right", textBaseline: "middle" });
    context.beginPath();
    for (const mark of this.axis.marks) {
      context.moveTo(LEFT_PX, y(mark));
      context.lineTo(width, y(mark));
      context.fillText(mark, LEFT_PX - 6, y(mark));
    }
    context.stroke();
    Object.assign(context, { textAlign: "center", textBaseline: "alphabetic" });
    for (let second = Math.ceil(first / 2) * 2; x(second) < width - 12; second += 2) {
      context.fillText(`${second} s`, Math.max(x(second), LEFT_PX + 8), height - 4);
    }
    const line = (values, strokeStyle, lineWidth, dash = []) => {
      Object.assign(context, { strokeStyle, lineWidth, lineJoin: "round" });
      context.setLineDash(dash);
      context.beginPath();
      values.forEach((value, row) => {
        if (value !== value) return; /* the drone is lost: a gap */
        const there = values[row - 1] === values[row - 1] && row > 0;
        context[there ? "lineTo" : "moveTo"](x(rows[row][0]), y(value));
      });
      context.stroke();
    };
    if (this.goal) this.goals(line, rows, shown, palette);
    for (const [index, values] of lines) line(values, palette.hues[drones[index].entry.hue], 1.8, drones[index].entry.dash);
    context.setLineDash([]);
  }

  /* Where the drones are to be, and floor and ceiling of those that have them. */
  goals(line, rows, shown, palette) {
    line(rows.map(this.goal), palette.target, 4);
    for (const { hue, walls } of shown.map((index) => this.world.drones[index].entry)) {
      walls.forEach((wall) => line(rows.map(() => wall), palette.hues[hue], 1, [8, 6]));
    }
  }
}
