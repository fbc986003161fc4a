"use strict";
/* Animates the drones of every flight on the page: play, pause, slider. Without scripts the paths are static. */
const SPEED = 4, TRAIL_S = 3, ARM_SHARE = 0.035, ROUND = 12;
const still = matchMedia("(prefers-reduced-motion: reduce)");

for (const figure of document.querySelectorAll(".flight")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const [button, slider, clock] = ["button", "input", "output"].map((name) => figure.querySelector(name));
  const above = figure.querySelector(".above"), side = figure.querySelector(".side");
  const arm = ARM_SHARE * above.viewBox.baseVal.width;
  const last = data.target.length - 1;
  let time = 0, before = null;

  /* Values at the current time, interpolated linearly; null where the flight is lost. */
  function at(samples) {
    const place = Math.min(Math.max((time - data.start) / data.step, 0), last);
    const low = samples[Math.floor(place)], high = samples[Math.ceil(place)];
    if (low.includes(null) || high.includes(null)) return null;
    return low.map((value, index) => value + (place % 1) * (high[index] - value));
  }

  /* Rotates a vector from the body frame (forward, right, down) to the world frame (north, east, down). */
  function toWorld([a, b, c], [roll, pitch, yaw]) {
    const [sr, cr, sp, cp, sy, cy] = [roll, pitch, yaw].flatMap((mrad) => [Math.sin(mrad / 1e3), Math.cos(mrad / 1e3)]);
    const [b1, c1] = [b * cr - c * sr, b * sr + c * cr];
    const [a2, c2] = [a * cp + c1 * sp, c1 * cp - a * sp];
    return [a2 * cy - b1 * sy, a2 * sy + b1 * cy, c2];
  }

  /* Outlines of an enlarged drone: two arms, four rotors. */
  function outlines(position, angles) {
    const tips = [[1, 1], [-1, -1], [1, -1], [-1, 1]].map(([a, b]) => [a * arm, b * arm, 0]);
    const lines = [[tips[0], tips[1]], [tips[2], tips[3]]];
    for (const [a, b] of tips) {
      lines.push(Array.from({ length: ROUND + 1 }, (_, k) => {
        const angle = 2 * Math.PI * k / ROUND;
        return [a + 0.7 * arm * Math.cos(angle), b + 0.7 * arm * Math.sin(angle), -0.2 * arm];
      }));
    }
    return lines.map((line) => line.map((point) => toWorld(point, angles).map((value, k) => value + position[k])));
  }

  const path = (lines, down) =>
    lines.map((line) => "M" + line.map((point) => `${point[0].toFixed(1)},${point[down].toFixed(1)}`).join(" ")).join("");

  function show() {
    const target = at(data.target);
    above.querySelector(".aim").setAttribute("transform", `translate(${target})`);
    side.querySelector(".aim").setAttribute("transform", `translate(${target[0]} 0)`);
    data.drones.forEach((drone, index) => {
      const position = at(drone.position), lines = position ? outlines(position, at(drone.angles)) : [];
      const first = Math.max(0, Math.ceil((time - TRAIL_S - data.start) / data.step));
      const trail = drone.position.slice(first, Math.floor((time - data.start) / data.step) + 1);
      if (position) lines.push([...trail.filter((point) => !point.includes(null)), position]);
      above.querySelectorAll(".drone")[index].setAttribute("d", path(lines, 1));
      side.querySelectorAll(".drone")[index].setAttribute("d", path(lines, 2));
      const error = position && Math.hypot(position[0] - target[0], position[1] - target[1]) / 100;
      figure.querySelectorAll(".error")[index].textContent = position ? `${error.toFixed(2)} m off` : "lost";
    });
    clock.textContent = `${time.toFixed(1)} s`;
    slider.value = time;
    slider.setAttribute("aria-valuetext", clock.textContent);
  }

  function play(on) {
    before = on ? performance.now() : null;
    button.textContent = on ? "Pause" : "Play";
    if (on) requestAnimationFrame(step);
  }

  /* With reduced motion one frame per second instead of smooth motion. */
  function step(now) {
    if (before === null) return;
    const passed = (now - before) / 1000;
    if (!still.matches || passed >= 1) {
      before = now;
      time = Math.min(time + SPEED * Math.max(0, Math.min(passed, still.matches ? 1 : 0.1)), slider.max);
      show();
      if (time >= slider.max) return play(false);
    }
    requestAnimationFrame(step);
  }

  button.addEventListener("click", () => {
    if (before === null && time >= slider.max) time = data.start;
    play(before === null);
  });
  slider.addEventListener("input", () => { time = Number(slider.value); show(); });
  figure.querySelector(".controls").hidden = false;
  time = data.start;
  show();
}
