/* The page: loads the modules, flies the proof, then flies in real time. */
const MOST_UPDATES_S = 0.1, TABLE_S = 0.25;
const still = matchMedia("(prefers-reduced-motion: reduce)"), dark = matchMedia("(prefers-color-scheme: dark)");

/* Advances the world with the clock of the display, by a bounded number of updates a picture. */
class Player {
  constructor(world, views) {
    Object.assign(this, { world, views, playing: false, before: null, owed: 0, request: 0, drawn: -Infinity, told: -Infinity });
    this.palette = colours();
    dark.addEventListener("change", () => this.recolour());
    addEventListener("resize", () => this.redraw());
  }

  recolour() {
    this.palette = colours();
    this.redraw();
  }

  /* Draws all; what stands still, or moves without motion, is looked at where it is. */
  redraw() {
    if (!this.playing || still.matches) this.views[0].follow(Infinity);
    this.views.forEach((view) => view.draw(this.palette));
  }

  play(on) {
    Object.assign(this, { playing: on, before: null });
    find("pause").textContent = on ? "Pause" : "Fly";
    say(on ? "Flying." : "Paused.");
    cancelAnimationFrame(this.request);
    if (on) this.request = requestAnimationFrame((now) => this.frame(now));
  }

  /* One picture of the display at a time in ms. With reduced motion it is drawn once a second. */
  frame(now) {
    if (!this.playing) return;
    const passed = this.before === null ? 0 : Math.max(0, now - this.before) / 1000;
    this.before = now;
    this.owed += Math.min(passed, MOST_UPDATES_S);
    const updates = Math.floor(this.owed / this.world.data.period_s);
    this.owed -= updates * this.world.data.period_s;
    this.world.advance(updates);
    if (!still.matches || now - this.drawn >= 1000) {
      this.drawn = now;
      this.views[0].follow(passed);
      this.redraw();
    }
    if (now - this.told >= 1000 * (still.matches ? 1 : TABLE_S)) {
      this.told = now;
      this.controls.numbers();
    }
    this.request = requestAnimationFrame((next) => this.frame(next));
  }
}

/* Compares the digests of this browser with the native ones, and says the result. */
async function prove(data) {
  const output = find("proof"), cells = [...document.querySelectorAll(".here")];
  if (!globalThis.crypto?.subtle) {
    output.textContent = "Not compared: the browser computes SHA-256 only for pages from a file or over https.";
    return;
  }
  const found = await proveAll(data);
  const same = found.map((digest, index) => digest === data.drones[index].digest);
  found.forEach((digest, index) => {
    cells[index].textContent = `${same[index] ? "\u2713" : "\u2717"} ${digest.slice(0, same[index] ? 12 : 60)}`;
    cells[index].className = `word here ${same[index] ? "passed" : "failed"}`;
  });
  const all = same.every(Boolean);
  output.className = `finding ${all ? "passed" : "failed"}`;
  output.textContent = all
    ? "\u2713 The same bits: each flight in this browser has the digest of the native one."
    : "\u2717 Not the same bits: a flight in this browser differs from the native one.";
}

async function start() {
  const data = JSON.parse(find("data").textContent);
  await prove(data);
  const drones = await Promise.all(data.drones.map(async (entry) => new Drone(await Module.load(entry), entry, data)));
  const world = new World(drones, data), field = new Field(find("field"), world);
  const plots = [
    new Plot(find("errors"), world, (row, drone) => 100 * world.error(row, drone), LOGARITHMIC_CM),
    new Plot(find("tilts"), world, tiltOf, DEGREES),
  ];
  if (data.spatial) plots.push(new Plot(find("heights"), world, (row, drone) => stateOf(row, drone)[2], HEIGHT_M, (row) => row[3]));
  const player = new Player(world, [field, ...plots]);
  player.controls = new Controls(world, field, player);
  player.play(!still.matches);
  if (still.matches) say("Paused, since this device asks for reduced motion.");
  return { world, player, advance(seconds) { world.advance(Math.round(seconds / data.period_s)); player.controls.numbers(); player.redraw(); } };
}

/* What surrounds this page, such as the manual, may say whether it is light or dark. */
const { media } = [...document.styleSheets[0].cssRules].find((rule) => rule.media?.mediaText === dark.media);
addEventListener("message", ({ source, data }) => {
  if (source !== parent || !["light", "dark"].includes(data)) return;
  media.mediaText = data === "dark" ? "all" : "not all";
  document.documentElement.style.colorScheme = data;
  globalThis.playground.then(({ player }) => player.recolour());
});

/* For the console: playground.then((page) => page.advance(10)). */
globalThis.playground = start();
globalThis.playground.catch((error) => say(`The drones cannot fly in this browser: ${error}`));
