// Places where the robot was: a bounded list of points, thinned where it is full.

const LIMIT = 4000;
const LEAST_M = 0.005;
const JUMP_M = 1;

export class Path {
  constructor() {
    /** Points [x, y, whether the line goes on here from the one before]. */
    this.points = [];
  }

  add(x, y) {
    const before = this.points[this.points.length - 1];
    const way = before ? Math.hypot(x - before[0], y - before[1]) : Infinity;
    if (way < LEAST_M) return;
    // A robot does not jump; its odometry does when it begins anew.
    this.points.push([x, y, way < JUMP_M]);
    if (this.points.length > LIMIT) this.thin();
  }

  /** Every other point of the older half. */
  thin() {
    const half = LIMIT / 2;
    this.points = this.points.filter((point, i) => i >= half || i % 2 === 0 || !point[2]);
    // The points are all jumps: the oldest go.
    if (this.points.length > LIMIT) this.points = this.points.slice(-half);
  }

  clear() {
    this.points = [];
  }
}
