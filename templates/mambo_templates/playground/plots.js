/* Plots over the last seconds; each drone has its colour and its dashes. */
const LEFT_PX = 34, BOTTOM_PX = 20, TOP_PX = 6;

class Plot {
  /* `limits` are the possible upper ends of the vertical axis. */
  constructor(canvas, world, value, limits) {
    Object.assign(this, { canvas, world, value, limits });
  }

  draw(palette) {
    const [context, width, height] = fit(this.canvas), { drawn: rows, drones } = this.world;
    const bottom = height - BOTTOM_PX, last = rows.at(-1)[0], first = Math.max(last, HISTORY_S) - HISTORY_S;
    const shown = drones.map((drone, index) => index).filter((index) => drones[index].shown).reverse();
    const lines = shown.map((index) => [index, rows.map((row) => this.value(row, index))]);
    const highest = lines.reduce((most, [, values]) => values.reduce((a, b) => (b > a ? b : a), most), 0);
    const limit = this.limits.find((one) => one >= highest) ?? this.limits.at(-1);
    const x = (time) => LEFT_PX + (time - first) / HISTORY_S * (width - LEFT_PX - 2);
    const y = (value) => bottom - Math.min(value / limit, 1) * (bottom - TOP_PX);
    Object.assign(context, { strokeStyle: palette.line, fillStyle: palette.quiet, lineWidth: 1, font: "12px system-ui, sans-serif", textAlign: "right", textBaseline: "middle" });
    context.beginPath();
    for (const share of [0, 0.5, 1]) {
      context.moveTo(LEFT_PX, y(share * limit));
      context.lineTo(width, y(share * limit));
      context.fillText(share * limit, LEFT_PX - 6, y(share * limit));
    }
    context.stroke();
    Object.assign(context, { textAlign: "center", textBaseline: "alphabetic" });
    for (let second = Math.ceil(first / 2) * 2; x(second) < width - 12; second += 2) {
      context.fillText(`${second} s`, Math.max(x(second), LEFT_PX + 8), height - 4);
    }
    for (const [index, values] of lines) {
      Object.assign(context, { strokeStyle: palette.hues[drones[index].entry.hue], lineWidth: 1.8, lineJoin: "round" });
      context.setLineDash(drones[index].entry.dash);
      context.beginPath();
      values.forEach((value, row) => { if (value === value) context.lineTo(x(rows[row][0]), y(value)); });
      context.stroke();
    }
    context.setLineDash([]);
  }
}
