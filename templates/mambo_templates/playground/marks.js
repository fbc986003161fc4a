/* What is drawn at one place of a picture, in pixels: a quadrotor, a cross, words. */
const BODY_PX = 7, ARM_PX = 9, ROTOR_PX = 6, EDGE_PX = 14, LINE_PX = 15, BESIDE_PX = 20;

/* The nearest place inside a canvas. */
function inside(canvas, [x, y]) {
  const between = (value, size) => Math.min(Math.max(value, EDGE_PX), size - EDGE_PX);
  return [between(x, canvas.clientWidth), between(y, canvas.clientHeight)];
}

/* A quadrotor from above with the number of the table: its nose is dark, and an axis that is tilted is shorter. */
function quadrotor(context, palette, colour, number, [x, y], [roll, pitch, yaw]) {
  const [along, across] = [ARM_PX * Math.cos(pitch), ARM_PX * Math.cos(roll)], [cosine, sine] = [Math.cos(yaw), Math.sin(yaw)];
  const at = (forward, right) => [x + cosine * forward - sine * right, y + sine * forward + cosine * right];
  context.setLineDash([]);
  for (const [forward, right] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const rotor = at(forward * along, right * across);
    Object.assign(context, { strokeStyle: colour, fillStyle: palette.paper, lineWidth: 1.5 });
    context.beginPath();
    context.arc(...rotor, ROTOR_PX, 0, 2 * Math.PI);
    context.fill();
    if (forward > 0) {
      context.fillStyle = colour;
      context.globalAlpha = 0.45;
      context.fill();
      context.globalAlpha = 1;
    }
    context.stroke();
  }
  Object.assign(context, { fillStyle: colour, strokeStyle: palette.paper, font: "bold 11px system-ui, sans-serif" });
  context.beginPath();
  context.arc(x, y, BODY_PX, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  Object.assign(context, { fillStyle: palette.paper, textAlign: "center", textBaseline: "middle" });
  context.fillText(number, x, y + 0.5);
  Object.assign(context, { textAlign: "start", textBaseline: "alphabetic" });
}

/* A cross where a drone was lost. */
function cross(context, colour, [x, y]) {
  Object.assign(context, { strokeStyle: colour, lineWidth: 3 });
  context.setLineDash([]);
  context.beginPath();
  for (const way of [1, -1]) {
    context.moveTo(x - ROTOR_PX - 4, y - way * (ROTOR_PX + 4));
    context.lineTo(x + ROTOR_PX + 4, y + way * (ROTOR_PX + 4));
  }
  context.stroke();
}

/* Words beside drones, each inside the canvas, and above or below those that stand there already. */
function labels(context, palette, canvas, list) {
  const { clientWidth, clientHeight } = canvas, placed = [];
  Object.assign(context, { strokeStyle: palette.paper, lineWidth: 4, font: "600 12px system-ui, sans-serif" });
  context.setLineDash([]);
  for (const { words, colour, place: [x, y] } of list) {
    const { width } = context.measureText(words), step = y > clientHeight / 2 ? -LINE_PX : LINE_PX;
    const beside = x + BESIDE_PX + width < clientWidth ? x + BESIDE_PX : x - BESIDE_PX - width, left = Math.max(4, Math.min(beside, clientWidth - width - 4));
    let base = y + 4;
    while (placed.some((one) => Math.abs(one.base - base) < LINE_PX - 2 && left < one.right && left + width > one.left)) base += step;
    placed.push({ left, right: left + width, base });
    context.fillStyle = colour;
    context.strokeText(words, left, base);
    context.fillText(words, left, base);
  }
}
/* The wind: streaks that drift over the field, and an arrow with its mean speed at the drone. */
const STREAKS = 28, STREAK_S = 0.06, STREAK_PX = 12, WIND_FROM_PX = 84, WIND_TO_PX = 40, HEAD_PX = 8;

/* Direction of the wind as a unit vector, with x right and y down. */
function windWay(world) {
  const angle = world.value("towards") * Math.PI / 180;
  return [Math.cos(angle), Math.sin(angle)];
}

/* Mean speed at the height of a level course, in m/s; the slider's is 20 ft above the ground. */
function windSpeed(world) {
  const index = world.data.dials.findIndex((dial) => dial.key === "wind");
  return world.data.dials[index].members.gust_mean_m_s[world.dials[index]][0];
}

/* Lines as long as the air flows in STREAK_S, which move with it. */
function drawStreaks(context, palette, field, width, height) {
  const { world, view } = field, speed = windSpeed(world), way = windWay(world);
  if (!speed) return;
  const length = STREAK_PX + STREAK_S * speed * view.scale, drift = speed * world.time * view.scale;
  const wrap = (value, size) => ((value % size) + size) % size;
  Object.assign(context, { strokeStyle: palette.target, lineWidth: 1 });
  context.setLineDash([]);
  context.globalAlpha = 0.55;
  context.beginPath();
  for (let streak = 0; streak < STREAKS; streak++) { /* multiples of irrational numbers spread evenly */
    const x = wrap(streak * 0.7549 * width + drift * way[0], width), y = wrap(streak * 0.5698 * height + drift * way[1], height);
    context.moveTo(x, y);
    context.lineTo(x + length * way[0], y + length * way[1]);
  }
  context.stroke();
  context.globalAlpha = 1;
}

/* An arrow that ends beside a place, against which the wind blows; returns what to say at its other end. */
function windArrow(context, palette, world, [x, y]) {
  const [across, down] = windWay(world), at = (back, aside) => [x - back * across - aside * down, y - back * down + aside * across];
  Object.assign(context, { strokeStyle: palette.ink, lineWidth: 2 });
  context.setLineDash([]);
  context.beginPath();
  context.moveTo(...at(WIND_FROM_PX, 0));
  context.lineTo(...at(WIND_TO_PX, 0));
  context.moveTo(...at(WIND_TO_PX + HEAD_PX, HEAD_PX / 2));
  context.lineTo(...at(WIND_TO_PX, 0));
  context.lineTo(...at(WIND_TO_PX + HEAD_PX, -HEAD_PX / 2));
  context.stroke();
  return { words: `wind ${windSpeed(world).toFixed(1)} m/s here`, colour: palette.ink, place: at(WIND_FROM_PX, 0) };
}
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
