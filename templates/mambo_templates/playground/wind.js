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
