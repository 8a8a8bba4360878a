// The header and the status panel: what the bridge is doing, and in words why nothing moves.

import { announce } from "./announce.js";
import { byId, make, mark, quoted, say, show } from "./dom.js";
import { isModel, isReplay, received } from "./received.js";

const SOURCES = { __proto__: null, bridge: "bridge", ros2: "ROS 2", log: "recorded run", model: "model alone" };

const DEPLOYMENTS = { __proto__: null, layer: "supervision layer", automata: "automata" };

/** The definition is new. */
export function paintRobot() {
  const { definition } = received;
  if (definition === null) return;
  say(byId("robot"), definition.robot);
  const deployment = DEPLOYMENTS[definition.deployment] ?? "controller";
  const source = SOURCES[definition.source] ?? definition.source;
  say(byId("about"), [deployment, source, definition.version].filter(Boolean).join(" · "));
  document.title = `${definition.robot} – RoboSC live view`;
}

let lastState = null;
let lastCauses = null;

/** The update is new. */
export function paintStatus() {
  const { update } = received;
  const state = update?.state || (isReplay() ? "recorded" : isModel() ? "stepped by hand" : "not known");
  say(byId("state-word"), state);
  mark(byId("state"), "data-state", update?.state || "unknown");
  if (update === null) {
    lastState = lastCauses = null;
    lastDevices = "";
    byId("causes").replaceChildren();
    byId("devices").replaceChildren();
    paintTimes([]);
    return;
  }
  const causes = causesOf(update);
  // A model alone has no status, except for what is wrong with its file.
  show(byId("status"), !isModel() || causes.length > 0);
  const key = JSON.stringify(causes);
  if (key !== lastCauses) {
    byId("causes").replaceChildren(...causes.map(causeLine));
    announce("causes", causes.map(({ lead, text }) => `${lead} ${text}`).join(" "));
  }
  if (lastState !== null && state !== lastState) announce("state", `State: ${state}.`);
  lastState = state;
  lastCauses = key;
  paintDevices(update.devices ?? {});
  paintTimes(update.latencies ?? []);
}

const TIMES = {
  __proto__: null,
  scan_to_wheel: "scan to wheel",
  scan_to_decision: "scan to decision",
  decision_period: "between decisions",
  queueing: "waiting of readings",
  exchange: "exchange with the wheels",
};

let lastTimes = "";

/** Times that the bridge measures of itself; other sources send none. */
function paintTimes(latencies) {
  const key = JSON.stringify(latencies);
  if (key === lastTimes) return;
  lastTimes = key;
  show(byId("times"), latencies.length > 0);
  byId("times-rows").replaceChildren(
    ...latencies.map(([name, half, most, longest]) =>
      make("tr", {}, make("th", { scope: "row" }, quoted(TIMES[name] ?? name)), ...[half, most, longest].map((ms) => make("td", {}, ms.toFixed(1)))),
    ),
  );
}

/** A bridge reports every cause that keeps its robot from moving; other sources report none. */
const NO_CAUSE = {
  bridge: { kind: "fine", lead: "", text: "Nothing keeps the robot from moving." },
  other: { kind: "unknown", lead: "", text: "This source does not report what keeps the robot from moving." },
};

function causesOf(update) {
  const causes = [];
  if (update.problem) causes.push({ kind: "fault", lead: "Fault:", text: update.problem });
  for (const reason of update.reasons ?? []) {
    const until = reason.holds_until_reset ? " (until reset)" : "";
    causes.push({ kind: "reason", lead: "Nothing moves:", text: reason.text + until });
  }
  for (const stop of update.stops ?? []) causes.push({ kind: "stop", lead: "Nothing is requested:", text: stop });
  if (causes.length === 0 && !isReplay() && !isModel()) causes.push(NO_CAUSE[received.definition?.source === "bridge" ? "bridge" : "other"]);
  for (const warning of update.warnings ?? []) causes.push({ kind: "warning", lead: "Warning:", text: warning.text ?? warning });
  return causes;
}

const SIGNS = { fault: "✕", reason: "■", stop: "■", warning: "▲", fine: "✓", unknown: "?" };

function causeLine({ kind, lead, text }) {
  const sign = make("span", { class: "sign", "aria-hidden": "true" }, SIGNS[kind]);
  return make("li", { class: `cause is-${kind}` }, sign, make("span", {}, make("strong", {}, lead), lead && " ", quoted(text)));
}

let lastDevices = "";

function paintDevices(devices) {
  const key = JSON.stringify(devices);
  if (key === lastDevices) return;
  lastDevices = key;
  byId("devices").replaceChildren(
    ...Object.entries(devices).map(([name, works]) =>
      make("li", { class: `chip ${works ? "is-there" : "is-missing"}` }, quoted(name), works ? " works" : " is not there"),
    ),
  );
}
