// The canvas: walls and line of the simulated world, the robot's way, the LiDAR's last revolution.

import { byId, mark, say, show } from "./dom.js";
import { figure } from "./format.js";
import { touch } from "./frame.js";
import { Path } from "./path.js";
import { paintMap } from "./picture.js";
import { received } from "./received.js";
import { Viewport } from "./viewport.js";

const MOVE_PX = 40;
const WORDS_EVERY_MS = 1000;

/** @returns {object} Functions that main.js calls. */
export function startMap() {
  const canvas = byId("map");
  const view = new Viewport();
  const path = new Path();
  const pointers = new Map();
  let isFollowing = true;
  let wordsMs = -Infinity;
  // Asked of the document once a change, since each question makes it lay itself out.
  const measure = () => Object.assign(view, { width: canvas.clientWidth, height: canvas.clientHeight });

  const change = () => touch("map");
  const follow = (isOn) => {
    isFollowing = isOn;
    mark(byId("map-follow"), "aria-pressed", isOn);
    change();
  };
  const zoom = (factor, px, py) => {
    view.zoom(factor, px, py);
    change();
  };
  const move = (dx, dy) => {
    view.move(dx, dy);
    follow(false);
  };
  const fit = () => {
    const { walls = [], line = [], way = [] } = received.definition?.scene ?? {};
    const pose = poseOf();
    view.fit([...walls.flatMap(([x1, y1, x2, y2]) => [[x1, y1], [x2, y2]]), ...line, ...way, ...path.points, ...(pose ? [pose] : [])]);
    follow(false);
  };

  byId("map-in").addEventListener("click", () => zoom(1.4));
  byId("map-out").addEventListener("click", () => zoom(1 / 1.4));
  byId("map-fit").addEventListener("click", fit);
  byId("map-follow").addEventListener("click", () => follow(!isFollowing));
  byId("map-clear").addEventListener("click", () => {
    path.clear();
    change();
  });

  canvas.addEventListener("keydown", (event) => {
    const actions = {
      ArrowLeft: () => move(MOVE_PX, 0), ArrowRight: () => move(-MOVE_PX, 0), ArrowUp: () => move(0, MOVE_PX), ArrowDown: () => move(0, -MOVE_PX),
      "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: fit, f: () => follow(!isFollowing),
    };
    if (event.ctrlKey || event.altKey || event.metaKey || !Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    actions[event.key]();
  });
  canvas.addEventListener("wheel", (event) => {
    // The page scrolls on without a key, unless the picture has the focus.
    if (!event.ctrlKey && document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
  }, { passive: false });

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const far = (point) => Math.max(Math.hypot(point[0] - other[0], point[1] - other[1]), 1);
      zoom(far(now) / far(before), other[0], other[1]);
    } else {
      move(now[0] - before[0], now[1] - before[1]);
    }
    pointers.set(event.pointerId, now);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  new ResizeObserver(() => {
    measure();
    change();
  }).observe(canvas);

  let wordsTimer = null;
  // Once a second is as quick as somebody reads; what came last is said in the end.
  const words = () => {
    const restMs = wordsMs + WORDS_EVERY_MS - performance.now();
    if (restMs > 0) {
      wordsTimer ??= setTimeout(sayNow, restMs);
      return;
    }
    sayNow();
  };
  const sayNow = () => {
    clearTimeout(wordsTimer);
    wordsTimer = null;
    if (poseOf() !== null) wordsMs = performance.now();
    say(byId("map-text"), inWords());
  };

  return {
    build() {
      const hasScene = Boolean(received.definition.scene);
      show(byId("surroundings"), hasScene);
      measure();
      if (hasScene) fit();
      follow(!hasScene);
    },
    /** The update is new. */
    updated() {
      const pose = received.update?.drive?.pose;
      if (pose) path.add(pose[0], pose[1]);
    },
    /** Another robot, or another time of a recorded run. */
    clear() {
      path.clear();
      change();
    },
    paint() {
      const pose = poseOf();
      if (!pose && !received.scan && !received.definition?.scene) return;
      show(byId("surroundings"), true);
      const ratio = window.devicePixelRatio || 1;
      const { width, height } = view;
      if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
        canvas.width = Math.round(width * ratio);
        canvas.height = Math.round(height * ratio);
      }
      if (isFollowing && pose) Object.assign(view, { x: pose[0], y: pose[1] });
      const context = canvas.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      paintMap(context, view, { scene: received.definition?.scene, path: path.points, scan: received.scan, pose });
      words();
    },
  };
}

const poseOf = () => received.update?.drive?.pose ?? received.scan?.pose ?? null;

function inWords() {
  const drive = received.update?.drive;
  const pose = poseOf();
  const parts = [];
  if (pose) {
    const degrees = ((pose[2] * 180) / Math.PI) % 360;
    parts.push(`Robot at x ${figure(pose[0], 2)} m, y ${figure(pose[1], 2)} m, heading ${figure(degrees, 0)}°.`);
  }
  if (drive) parts.push(`Moves at ${figure(drive.linear_m_s, 2)} m/s, rotates at ${figure(drive.angular_rad_s, 2)} rad/s.`);
  if (Number.isFinite(drive?.battery_v)) parts.push(`Battery ${figure(drive.battery_v, 1)} V.`);
  if (typeof drive?.is_torque_on === "boolean") parts.push(drive.is_torque_on ? "Motors hold." : "Motors do not hold.");
  const nearest = nearestOf(received.scan?.ranges_m ?? []);
  if (nearest) parts.push(`Nearest thing ${figure(nearest.range, 2)} m away, ${nearest.where}.`);
  return parts.join(" ") || "Nothing is known about where the robot is.";
}

function nearestOf(ranges) {
  let at = -1;
  ranges.forEach((range, i) => {
    if (range !== null && (at < 0 || range < ranges[at])) at = i;
  });
  if (at < 0) return null;
  const degrees = (at * 360) / ranges.length;
  const side = degrees > 180 ? `${figure(360 - degrees, 0)}° to the right` : `${figure(degrees, 0)}° to the left`;
  return { range: ranges[at], where: degrees === 0 ? "straight ahead" : side };
}
