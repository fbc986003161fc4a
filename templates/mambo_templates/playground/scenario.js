/* The scenario in the fragment of the address: what differs from the page's start. */
const CURVES = ["eight", "circle", "hand"];

function fragmentOf(world) {
  const words = new URLSearchParams(), { target, data } = world;
  if (target.kind !== "eight") words.set("target", target.kind);
  if (target.kind === "hand") words.set("at", target.goal.map((value) => value.toFixed(2)).join(","));
  data.dials.forEach((dial, index) => {
    if (world.dials[index] !== dial.start) words.set(dial.key, dial.values[world.dials[index]]);
  });
  if (world.fence) words.set("fence", world.fence.join(","));
  const hidden = world.drones.flatMap((drone, index) => (drone.shown ? [] : [index + 1]));
  if (hidden.length) words.set("without", hidden.join(","));
  return words.toString();
}

/* Starts the world anew as a fragment says; what it does not understand it leaves at the start. */
function restore(world, fragment) {
  const words = new URLSearchParams(fragment), { target, data } = world;
  const at = (words.get("at") || "0,0").split(",").map(Number);
  target.kind = "eight";
  target.goal = [0, 0];
  if (words.get("target") === "hand" && at.length === 2 && at.every(Number.isFinite)) target.drag(...at);
  else if (words.get("target") !== "hand" && CURVES.includes(words.get("target"))) target.kind = words.get("target");
  const fence = (words.get("fence") || "").split(",").map(Number), [left, top, right, bottom] = fence;
  const good = fence.length === 4 && fence.every((value) => Math.abs(value) <= MOST_VIEW_M) && left < right && top < bottom;
  world.fence = good ? fence : null;
  world.dials = data.dials.map((dial) => {
    const place = words.has(dial.key) ? dial.values.indexOf(Number(words.get(dial.key))) : -1;
    return place < 0 ? dial.start : place;
  });
  const hidden = (words.get("without") || "").split(",").map(Number);
  world.drones.forEach((drone, index) => { drone.shown = !hidden.includes(index + 1); });
  world.begin();
}
