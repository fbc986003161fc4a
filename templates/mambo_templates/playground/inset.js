/* The surroundings of the target, larger, in a corner of the field: each drone with its way of the last second, as seen from the target. */
const INSET_TIMES = 20, INSET_PX = 132, INSET_SHARE = 0.3, INSET_GAP_PX = 8, INSET_REACH_PX = 40, INSET_TRAIL_S = 1, INSET_DOT_PX = 4, INSET_BARS_CM = [1, 2, 5, 10, 20, 50, 100];

/* Its place: upper right, or upper left while the target is there. */
function insetPlace(field, [x, y]) {
  const width = field.canvas.clientWidth, size = Math.min(INSET_PX, INSET_SHARE * width), reach = size + INSET_REACH_PX;
  return { left: x > width - reach && y < reach ? INSET_GAP_PX : width - size - INSET_GAP_PX, top: INSET_GAP_PX, size };
}

function drawInset(context, palette, field, rows, shown) {
  const now = rows.at(-1), scale = INSET_TIMES * field.view.scale, { left, top, size } = insetPlace(field, field.pixels(now[1], now[2]));
  const from = (row, index) => stateOf(row, index).slice(0, 2).map((value, axis) => size / 2 + scale * (value - row[1 + axis]));
  context.save();
  context.translate(left, top);
  context.setLineDash([]);
  Object.assign(context, { fillStyle: palette.paper, strokeStyle: palette.quiet, lineWidth: 1 });
  context.beginPath();
  context.rect(0, 0, size, size);
  context.fill();
  context.stroke();
  context.clip();
  insetAim(context, palette, size);
  const recent = rows.filter((row) => row[0] > now[0] - INSET_TRAIL_S);
  for (const index of shown) insetDrone(context, palette.hues[field.world.drones[index].entry.hue], recent.map((row) => from(row, index)), size);
  insetScale(context, palette, scale, size);
  context.restore();
}

/* The target is in the middle. */
function insetAim(context, palette, size) {
  Object.assign(context, { strokeStyle: palette.line, lineWidth: 1.5 });
  context.beginPath();
  [[0, 0.5], [1, 0.5], [0.5, 0], [0.5, 1]].forEach(([x, y], place) => context[place % 2 ? "lineTo" : "moveTo"](size * x, size * y));
  context.stroke();
}

/* Way and dot of one drone; a dot at the edge, half of it, is that of a drone that is farther away. */
function insetDrone(context, colour, way, size) {
  const places = way.filter(([x]) => Number.isFinite(x)), last = way.at(-1);
  Object.assign(context, { strokeStyle: colour, fillStyle: colour, lineWidth: 1.5 });
  context.beginPath();
  places.forEach((place) => context.lineTo(...place));
  context.stroke();
  if (!Number.isFinite(last[0])) return;
  context.beginPath();
  context.arc(...last.map((value) => Math.min(Math.max(value, 0), size)), INSET_DOT_PX, 0, 2 * Math.PI);
  context.fill();
}

/* How many times larger than the field, and a bar of some cm. */
function insetScale(context, palette, scale, size) {
  const cm = INSET_BARS_CM.findLast((one) => one / 100 * scale < size / 2) ?? INSET_BARS_CM[0], end = 6 + cm / 100 * scale;
  Object.assign(context, { strokeStyle: palette.ink, fillStyle: palette.ink, lineWidth: 2, font: "12px system-ui, sans-serif" });
  context.beginPath();
  [[6, size - 11], [6, size - 6], [end, size - 6], [end, size - 11]].forEach((point) => context.lineTo(...point));
  context.stroke();
  context.fillText(`${cm} cm`, 10, size - 11);
  context.fillText(`${INSET_TIMES} \u00d7`, 6, 15);
}
