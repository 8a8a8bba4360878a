// Draws the surroundings on a canvas, in the colours of the style sheet.

import { draw } from "./dom.js";

const NAMES = ["canvas", "grid", "wall", "line", "path", "scan", "robot", "ink"];
const LASER_PX = 1.6;
const ROBOT_M = 0.09;

let colours = null;

/** Colours have changed. */
export function forgetColours() {
  colours = null;
}

function coloursNow() {
  if (colours !== null) return colours;
  // A variable that depends on light and dark is only worked out where it is used.
  const probe = draw("svg", { class: "unseen" });
  document.body.append(probe);
  colours = {};
  for (const name of NAMES) {
    probe.style.color = `var(--map-${name})`;
    colours[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return colours;
}

/** Draws everything that is known. */
export function paintMap(context, view, { scene, path, scan, pose }) {
  const now = coloursNow();
  context.fillStyle = now.canvas;
  context.fillRect(0, 0, view.width, view.height);
  grid(context, view, now);
  if (scene) {
    strokes(context, view, scene.line ? [scene.line] : [], now.line, Math.max(0.02 * view.scale, 2));
    strokes(context, view, (scene.walls ?? []).map(([a, b, c, d]) => [[a, b], [c, d]]), now.wall, 3);
  }
  if (scene?.way) {
    // The path of a recorded run is known as a whole: its future is drawn faintly.
    context.globalAlpha = 0.35;
    strokes(context, view, [scene.way], now.path, 2);
    context.globalAlpha = 1;
  }
  way(context, view, path, now.path);
  if (scan) beams(context, view, scan.ranges_m ?? [], scan.pose ?? pose ?? [0, 0, 0], now.scan);
  if (pose) robot(context, view, pose, now.robot);
  ruler(context, view, now.ink);
}

function grid(context, view, now) {
  const step = view.step(36);
  context.strokeStyle = now.grid;
  context.lineWidth = 1;
  context.beginPath();
  const left = view.x - view.width / 2 / view.scale;
  for (let x = Math.ceil(left / step) * step; x <= left + view.width / view.scale; x += step) {
    const [px] = view.toScreen(x, 0);
    context.moveTo(Math.round(px) + 0.5, 0);
    context.lineTo(Math.round(px) + 0.5, view.height);
  }
  const bottom = view.y - view.height / 2 / view.scale;
  for (let y = Math.ceil(bottom / step) * step; y <= bottom + view.height / view.scale; y += step) {
    const [, py] = view.toScreen(0, y);
    context.moveTo(0, Math.round(py) + 0.5);
    context.lineTo(view.width, Math.round(py) + 0.5);
  }
  context.stroke();
}

function strokes(context, view, lines, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineCap = context.lineJoin = "round";
  context.beginPath();
  for (const line of lines) {
    line.forEach(([x, y], i) => (i === 0 ? context.moveTo(...view.toScreen(x, y)) : context.lineTo(...view.toScreen(x, y))));
  }
  context.stroke();
}

function way(context, view, points, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.setLineDash([]);
  context.beginPath();
  for (const [x, y, goesOn] of points) {
    if (goesOn) context.lineTo(...view.toScreen(x, y));
    else context.moveTo(...view.toScreen(x, y));
  }
  context.stroke();
}

function beams(context, view, ranges, [x, y, heading], colour) {
  context.fillStyle = colour;
  context.beginPath();
  ranges.forEach((range, i) => {
    if (range === null || !Number.isFinite(range)) return;
    const angle = heading + (i / ranges.length) * 2 * Math.PI;
    const [px, py] = view.toScreen(x + range * Math.cos(angle), y + range * Math.sin(angle));
    context.moveTo(px + LASER_PX, py);
    context.arc(px, py, LASER_PX, 0, 2 * Math.PI);
  });
  context.fill();
}

function robot(context, view, [x, y, heading], colour) {
  const [px, py] = view.toScreen(x, y);
  const radius = Math.max(ROBOT_M * view.scale, 7);
  context.fillStyle = context.strokeStyle = colour;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(px, py, radius, 0, 2 * Math.PI);
  context.stroke();
  context.beginPath();
  for (const [turn, far] of [[0, 1.5], [2.5, 0.75], [-2.5, 0.75]]) {
    context.lineTo(px + radius * far * Math.cos(heading + turn), py - radius * far * Math.sin(heading + turn));
  }
  context.fill();
}

function ruler(context, view, colour) {
  const step = view.step(60);
  const length = step * view.scale;
  const [x, y] = [14, view.height - 14];
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 2;
  context.lineCap = "butt";
  context.beginPath();
  context.moveTo(x, y - 5);
  context.lineTo(x, y);
  context.lineTo(x + length, y);
  context.lineTo(x + length, y - 5);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.fillText(step < 1 ? `${Math.round(step * 100)} cm` : `${step} m`, x + 5, y - 5);
}
