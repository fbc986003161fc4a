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
