/* Pointer, keyboard, buttons, sliders and table. */
const NEAR_PX = 24, STEP_M = 0.25, DRAG_N_S_M = 0.05, MOST_N_S = 0.1;
const ARROWS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };
const WAYS = { "1,0": "right", "-1,0": "left", "0,1": "down", "0,-1": "up" };
const find = (id) => document.getElementById(id);
const say = (text) => { find("status").textContent = text; };

class Controls {
  constructor(world, field, player) {
    Object.assign(this, { world, field, player });
    this.rows = [...document.querySelectorAll(".standing tbody tr")];
    this.pointer();
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
      const slider = find(dial.key), words = dial.values[world.dials[index]] + (dial.unit.length > 1 ? ` ${dial.unit}` : dial.unit);
      slider.value = world.dials[index];
      slider.setAttribute("aria-valuetext", words);
      document.querySelector(`output[for="${dial.key}"]`).textContent = words;
    });
    this.rows.forEach((row, index) => { row.querySelector("input").checked = world.drones[index].shown; });
    this.numbers();
  }

  /* The table's figures. */
  numbers() {
    const { history, drones } = this.world, now = history.at(-1);
    this.rows.forEach((row, index) => {
      const mean = history.reduce((sum, one) => sum + errorOf(one, index), 0) / history.length;
      const put = (name, text) => { row.querySelector(name).textContent = text; };
      const error = errorOf(now, index);
      put(".error", !Number.isFinite(error) ? "lost" : drones[index].answer[0] > 0n ? "refused" : `${error.toFixed(2)} m`);
      put(".mean", Number.isFinite(mean) ? `${mean.toFixed(2)} m` : "\u2013");
      put(".tilt", Number.isFinite(error) ? `${tiltOf(now, index).toFixed(0)}\u00b0` : "\u2013");
    });
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
      if (event.key === " ") this.player.play(!this.player.playing);
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

  /* Whether the pointer takes a drone: one that is near, and nearer than the target. */
  takes(point) {
    const now = this.world.history.at(-1);
    const away = (x, y) => Math.hypot(x - point[0], y - point[1]) * this.field.scale;
    const drones = this.world.drones.map((drone, index) =>
      drone.shown ? away(now[3 + PER_DRONE * index], now[4 + PER_DRONE * index]) : Infinity);
    const nearest = Math.min(...drones.filter(Number.isFinite));
    return nearest < NEAR_PX && nearest < away(now[1], now[2]) - 1;
  }

  pointer() {
    const { canvas } = this.field, { world, field } = this;
    const place = (event) => field.metres(event.offsetX, event.offsetY);
    canvas.addEventListener("pointerdown", (event) => {
      if (!event.isPrimary) return;
      canvas.setPointerCapture(event.pointerId);
      const point = place(event);
      if (this.takes(point)) field.arrow = [point, point];
      else world.target.drag(...point);
      this.held = true;
      this.player.redraw();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.held || !event.isPrimary) return;
      if (field.arrow) field.arrow = [field.arrow[0], place(event)];
      else world.target.drag(...place(event));
      this.player.redraw();
    });
    const release = (event) => {
      if (!this.held || !event.isPrimary) return;
      this.held = false;
      if (!field.arrow) return this.changed();
      const [[x, y], [u, v]] = field.arrow;
      field.arrow = null;
      if (event.type === "pointerup") this.push(atMost(MOST_N_S, [DRAG_N_S_M * (u - x), DRAG_N_S_M * (v - y)]), "");
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
  }
}
