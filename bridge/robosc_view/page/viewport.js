// Part of the floor that a canvas shows: metres to pixels and back, moved and zoomed.

const LEAST = 4;
const MOST = 2000;
const STEPS_M = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];

export class Viewport {
  constructor() {
    this.width = 1;
    this.height = 1;
    /** The point in the middle, in metres. */
    this.x = 0;
    this.y = 0;
    /** Pixels a metre. */
    this.scale = 80;
  }

  toScreen(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  /** Moves the picture by pixels. */
  move(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /** Zooms, with a point of the canvas in its place. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const before = [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
    this.scale = Math.min(Math.max(this.scale * factor, LEAST), MOST);
    this.x = before[0] - (px - this.width / 2) / this.scale;
    this.y = before[1] + (py - this.height / 2) / this.scale;
  }

  /** Shows all of some points. */
  fit(points) {
    const known = points.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
    if (known.length === 0) return;
    const [x1, x2, y1, y2] = known.reduce(
      ([a, b, c, d], [x, y]) => [Math.min(a, x), Math.max(b, x), Math.min(c, y), Math.max(d, y)], [Infinity, -Infinity, Infinity, -Infinity]);
    this.x = (x1 + x2) / 2;
    this.y = (y1 + y2) / 2;
    if (this.width <= 48 || this.height <= 48) return;
    const fitting = Math.min((this.width - 48) / Math.max(x2 - x1, 1), (this.height - 48) / Math.max(y2 - y1, 1));
    this.scale = Math.min(Math.max(fitting, LEAST), MOST);
  }

  /** A round length in metres that is about so many pixels. */
  step(pixels) {
    return STEPS_M.find((step) => step * this.scale >= pixels) ?? STEPS_M[STEPS_M.length - 1];
  }
}
