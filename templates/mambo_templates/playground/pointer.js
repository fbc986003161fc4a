/* Mouse or finger on the field: moves the target, pushes drones, or draws a fence. */
const NEAR_PX = 24, DRAG_N_S_M = 0.05, MOST_N_S = 0.1;

class Pointer {
  constructor(controls) {
    const { canvas } = controls.field;
    Object.assign(this, { controls, place: null, before: 0 });
    canvas.addEventListener("pointerdown", (event) => {
      if (!event.isPrimary) return;
      canvas.setPointerCapture(event.pointerId);
      this.begin([event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.place && event.isPrimary) this.move([event.offsetX, event.offsetY]);
    });
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, (event) => { if (this.place && event.isPrimary) this.end(kind === "pointerup"); });
    }
  }

  begin(place) {
    const { field, world } = this.controls, point = field.view.metres(...place);
    if (field.drawing) field.corners = [point, point];
    else if (this.takes(point)) field.arrow = [point, point];
    else world.target.drag(...point);
    Object.assign(this, { place, before: performance.now() });
    field.held = true;
    this.controls.player.redraw();
    requestAnimationFrame((now) => this.hold(now));
  }

  move(place) {
    const { field, world, player } = this.controls, point = field.view.metres(...place);
    this.place = place;
    if (field.corners) field.corners = [field.corners[0], point];
    else if (field.arrow) field.arrow = [field.arrow[0], point];
    else world.target.drag(...point);
    player.redraw();
  }

  /* While it is held at the edge, the view grows, and what it moves stays under it. */
  hold(now) {
    if (!this.place) return;
    const { field } = this.controls, { width } = field.view;
    if (!field.arrow) field.view.widen(Math.max(0, now - this.before) / 1000, ...this.place);
    this.before = now;
    if (field.view.width > width) this.move(this.place);
    requestAnimationFrame((next) => this.hold(next));
  }

  end(released) {
    const { controls } = this, { field, world } = controls, { arrow, corners } = field;
    Object.assign(field, { arrow: null, corners: null, held: false });
    this.place = null;
    if (corners) {
      if (released) controls.enclose(...corners);
    } else if (arrow) {
      const [[x, y], [u, v]] = arrow;
      if (released) controls.push(atMost(MOST_N_S, [DRAG_N_S_M * (u - x), DRAG_N_S_M * (v - y)]), "");
    } else {
      world.target.release();
      controls.changed();
    }
    controls.player.redraw();
  }

  /* Whether the pointer takes a drone: one that is near, and nearer than the target. */
  takes(point) {
    const { world, field } = this.controls, now = world.history.at(-1);
    const away = (x, y) => Math.hypot(x - point[0], y - point[1]) * field.view.scale;
    const drones = world.drones.map((drone, index) =>
      drone.shown ? away(...stateOf(now, index)) : Infinity);
    const nearest = Math.min(...drones.filter(Number.isFinite));
    return nearest < NEAR_PX && nearest < away(now[1], now[2]) - 1;
  }
}
