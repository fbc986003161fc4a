/* Keyboard, buttons, sliders and table. */
const STEP_M = 0.25, AWAY_M = 30, LEAST_FENCE_M = 0.5, FENCE_M = 1;
const ARROWS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };
const WAYS = { "1,0": "right", "-1,0": "left", "0,1": "down", "0,-1": "up" };
const find = (id) => document.getElementById(id);
const distance = (value) => (value < 0.0995 ? `${(100 * value).toFixed(1)} cm` : value < 9.995 ? `${(100 * value).toFixed(0)} cm` : `${value.toFixed(1)} m`);
const titles = (drones) => drones.map((drone) => drone.entry.title).join(", ");
const say = (text) => { find("status").textContent = text; };

/* Mean distance of a drone to the target over the history, without the time in which it was lost. */
function meanOf(world, drone) {
  const errors = world.history.map((row) => world.error(row, drone)).filter(Number.isFinite);
  return errors.reduce((sum, one) => sum + one, 0) / errors.length;
}

/* In words: who is closest in the mean of `seconds`, how much farther away the others are, and who is lost, and why. */
function verdict(drones, means, seconds) {
  const shown = drones.map((drone, index) => ({ drone, name: drone.entry.title, mean: means[index] })).filter(({ drone }) => drone.shown);
  const [best, ...others] = shown.filter(({ drone, mean }) => !drone.lost && mean > 0).sort((a, b) => a.mean - b.mean);
  const lost = shown.filter(({ drone }) => drone.lost).map(({ drone, name }) => `${name} is lost: ${drone.lost.why}; it starts again at the target.`);
  const again = shown.filter(({ drone }) => drone.losses && !drone.lost).map(({ drone, name }) => `${name} was lost ${drone.losses === 1 ? "once" : `${drone.losses} times`}.`);
  const farther = others.map(({ name, mean }) => `${name} ${(mean / best.mean).toFixed(mean < 9.95 * best.mean ? 1 : 0)} times as far`);
  const first = best && `${best.name} is closest: ${distance(best.mean)} from the target in the mean of the last ${Math.round(seconds)} s`;
  return [...(best ? [`${[first, ...farther].join(", ")}.`] : []), ...lost, ...again].join(" ");
}

class Controls {
  constructor(world, field, player) {
    Object.assign(this, { world, field, player });
    this.rows = [...document.querySelectorAll(".standing tbody tr")];
    this.pointer = new Pointer(this);
    this.keyboard();
    this.buttons();
    world.data.dials.forEach((dial, index) => {
      find(dial.key).addEventListener("input", (event) => {
        world.turn(index, Number(event.target.value));
        this.changed();
      });
    });
    this.rows.forEach((row, index) => row.querySelector("input").addEventListener("change", (event) => {
      world.drones[index].shown = event.target.checked;
      this.changed();
    }));
    addEventListener("hashchange", () => this.restore());
    this.restore();
  }

  restore() {
    restore(this.world, location.hash.slice(1));
    this.show();
    this.player.redraw();
  }

  /* After every change of the scenario: fragment and page say what is. */
  changed() {
    history.replaceState(null, "", `#${fragmentOf(this.world)}`);
    this.show();
    this.player.redraw();
  }

  show() {
    const { world } = this;
    find("target").value = world.target.kind;
    world.data.dials.forEach((dial, index) => {
      const slider = find(dial.key), words = dial.values[world.dials[index]] + (/^[a-z]/.test(dial.unit) ? ` ${dial.unit}` : dial.unit);
      slider.value = world.dials[index];
      slider.setAttribute("aria-valuetext", words);
      document.querySelector(`output[for="${dial.key}"]`).textContent = words;
    });
    this.rows.forEach((row, index) => { row.querySelector("input").checked = world.drones[index].shown; });
    if (world.data.spatial) find("heights").parentElement.hidden = !world.target.swing && world.target.kind !== "plan";
    this.fenceButton();
    this.numbers();
  }

  fenceButton() {
    find("fence").textContent = this.world.fence ? "Remove the fence" : this.field.drawing ? "Cancel the fence" : "Draw a fence";
  }

  /* The table's figures, and the verdict. */
  numbers() {
    const { history, drones } = this.world, now = history.at(-1), means = drones.map((_, index) => meanOf(this.world, index));
    this.rows.forEach((row, index) => {
      const put = (name, text) => { row.querySelector(name).textContent = text; };
      const { lost, answer } = drones[index];
      const [plane, height] = this.world.errors(now, index).map(distance);
      put(".error", lost ? "lost" : answer[0] > 0n ? "refused" : plane);
      if (this.world.data.spatial) put(".height", lost ? "\u2013" : height);
      put(".mean span", Number.isFinite(means[index]) ? distance(means[index]) : "\u2013");
      put(".tilt", lost ? "\u2013" : `${tiltOf(now, index).toFixed(0)}\u00b0`);
      row.querySelector(".bar").style.width = `${100 * Math.min(LOGARITHMIC_CM.share(100 * (means[index] || 0)), 1)}%`;
    });
    find("verdict").textContent = verdict(drones, means, history.length * this.world.data.period_s);
    const without = titles(drones.filter((drone) => !drone.limited));
    const speeds = drones.map((drone) => `${drone.entry.title} ${drone.lost ? "lost" : drone.speedWords}`);
    find("limits").textContent = [...speeds, ...(without ? [`without limits: ${without}`] : [])].join("; ");
  }

  /* Puts a fence between two corners, in m; null removes it. */
  enclose(from, to) {
    const { world, field } = this, corners = from && [0, 1].map((axis) => [from[axis], to[axis]].sort((a, b) => a - b));
    field.drawing = false;
    if (corners && corners.some(([least, most]) => most - least < LEAST_FENCE_M)) {
      say(`A fence has sides of ${LEAST_FENCE_M} m or more: drag from corner to corner.`);
    } else {
      const [[left, right], [top, bottom]] = corners ?? [[], []];
      const words = world.enclose(corners ? [left, top, right, bottom].map((value) => Number(value.toFixed(2))) : null);
      say(corners ? `Fence of ${(right - left).toFixed(1)} by ${(bottom - top).toFixed(1)} m. ${words}` : "The fence is removed.");
    }
    this.changed();
  }

  /* Removes the fence, or lets the pointer draw one, or not. */
  fence() {
    const { field } = this;
    if (this.world.fence) return this.enclose(null);
    field.drawing = !field.drawing;
    this.fenceButton();
    return say(field.drawing ? "Drag from corner to corner of the fence." : "No fence.");
  }

  push(impulse, words) {
    this.world.push(impulse);
    say(`Pushed every drone ${words}with ${(1000 * Math.hypot(...impulse)).toFixed(0)} mN s.`);
    this.player.redraw();
  }

  buttons() {
    find("pause").addEventListener("click", () => this.player.play(!this.player.playing));
    find("push").addEventListener("click", () => this.push([0, IMPULSE_N_S], "down "));
    find("again").addEventListener("click", () => { this.restore(); say("Started again."); });
    find("target").addEventListener("change", (event) => {
      const { world } = this;
      if (event.target.value === "hand") {
        world.target.drag(world.target.now[0], world.target.now[1]);
      } else {
        world.target.kind = event.target.value;
        world.begin();
      }
      this.changed();
    });
    find("fence").addEventListener("click", () => this.fence());
    find("away").addEventListener("click", () => {
      const { target } = this.world, x = target.now[0] > AWAY_M / 2 ? 0 : AWAY_M;
      target.drag(x, 0);
      target.release();
      this.changed();
      say(`Target at x ${x} m, y 0 m.`);
    });
    find("link").addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(location.href);
        say("The link to this scenario is copied.");
      } catch {
        say("The browser does not let this page copy; the address bar has the link to this scenario.");
      }
    });
  }

  keyboard() {
    this.field.canvas.addEventListener("keydown", (event) => {
      const way = ARROWS[event.key], { target } = this.world;
      if (event.key === "f" && !event.ctrlKey && !event.metaKey) {
        const [x, y] = target.now;
        if (this.world.fence) this.enclose(null);
        else this.enclose([x - FENCE_M, y - FENCE_M], [x + FENCE_M, y + FENCE_M]);
      } else if (event.key === " ") this.player.play(!this.player.playing);
      else if (!way) return;
      else if (event.shiftKey) this.push(way.map((part) => part * IMPULSE_N_S), `${WAYS[way]} `);
      else {
        const from = target.kind === "hand" ? target.goal : target.now;
        target.drag(from[0] + STEP_M * way[0], from[1] + STEP_M * way[1]);
        this.changed();
        say(`Target at x ${target.goal[0].toFixed(2)} m, y ${target.goal[1].toFixed(2)} m.`);
      }
      event.preventDefault();
    });
  }
}
