// Lines of graphs: cut at the borders of boxes, with round corners and heads.

const CORNER = 10;
const HEAD = 8;

const isInside = ([x, y], box) => Math.abs(x - box.x) < box.width / 2 - 0.01 && Math.abs(y - box.y) < box.height / 2 - 0.01;

/** Point where the way from a point in a box to one outside leaves it. */
function border([x1, y1], [x2, y2], box) {
  const dx = x2 - x1;
  const dy = y2 - y1;
  const tx = dx === 0 ? Infinity : (box.x + Math.sign(dx) * box.width / 2 - x1) / dx;
  const ty = dy === 0 ? Infinity : (box.y + Math.sign(dy) * box.height / 2 - y1) / dy;
  const t = Math.min(tx, ty);
  return [x1 + t * dx, y1 + t * dy];
}

function cutStart(points, box) {
  const rest = [...points];
  while (rest.length > 2 && isInside(rest[0], box) && isInside(rest[1], box)) rest.shift();
  if (isInside(rest[0], box) && !isInside(rest[1], box)) rest[0] = border(rest[0], rest[1], box);
  return rest;
}

/** A loop above a box, for a layout that has not drawn one. */
function loop(box) {
  const top = box.y - box.height / 2;
  const half = Math.min(box.width / 4, 14);
  return [[box.x - half, top], [box.x - half, top - 18], [box.x + half, top - 18], [box.x + half, top]];
}

/**
 * The points of an edge between the borders of its states' boxes.
 *
 * @param {number[][]} points As the layout has them.
 * @param {{x: number, y: number, width: number, height: number}} source Box of the first state, by its middle.
 * @param {{x: number, y: number, width: number, height: number}} target Box of the second.
 */
export function route(points, source, target) {
  if (source === target && points.length < 3) return loop(source);
  const whole = points.length >= 2 ? points : [[source.x, source.y], [target.x, target.y]];
  if (source === target) return whole;
  return cutStart(cutStart(whole, source).reverse(), target).reverse();
}

const number = (value) => Math.round(value * 10) / 10;
const at = ([x, y]) => `${number(x)} ${number(y)}`;

function towards([x1, y1], [x2, y2], most) {
  const length = Math.hypot(x2 - x1, y2 - y1);
  const share = length === 0 ? 0 : Math.min(most / length, 0.5);
  return [x1 + (x2 - x1) * share, y1 + (y2 - y1) * share];
}

/** The data of a path through points, its corners rounded. */
export function rounded(points) {
  let data = `M${at(points[0])}`;
  for (let i = 1; i < points.length - 1; i += 1) {
    data += `L${at(towards(points[i], points[i - 1], CORNER))}Q${at(points[i])} ${at(towards(points[i], points[i + 1], CORNER))}`;
  }
  return `${data}L${at(points[points.length - 1])}`;
}

/** The data of an arrow's head at the end of a line through points. */
export function head(points) {
  const [x, y] = points[points.length - 1];
  const [bx, by] = points[points.length - 2];
  const angle = Math.atan2(y - by, x - bx);
  const corner = (turn) => [x - HEAD * Math.cos(angle + turn), y - HEAD * Math.sin(angle + turn)];
  return `M${at([x, y])}L${at(corner(0.42))}L${at(corner(-0.42))}Z`;
}
