// Connects the parts of the page to the data from the server.

import { startComponents } from "./components.js";
import { Connection } from "./connection.js";
import { paints, touch } from "./frame.js";
import { startFreshness } from "./freshness.js";
import { startGoals } from "./goals.js";
import { startMap } from "./map.js";
import { startOrders } from "./orders.js";
import { forgetColours } from "./picture.js";
import { startPlay } from "./play.js";
import { startReplay } from "./replay.js";
import { startRequests } from "./requests.js";
import { paintRobot, paintStatus } from "./status.js";
import { startStream } from "./stream.js";
import { startTheme } from "./theme.js";
import { forget, isModel, received } from "./received.js";
import { takeToken } from "./token.js";

let connection = null;
const token = takeToken();
const orders = startOrders(() => connection, token);
const components = startComponents();
const requests = startRequests();
const goals = startGoals();
const stream = startStream();
const map = startMap();
const replay = startReplay((message) => connection.send(message));
const play = startPlay((message) => connection.send(message), token);
const lookAtFreshness = startFreshness(() => connection);

let known = "";
let wasLost = false;

const receive = {
  definition(message) {
    forget();
    received.definition = message;
    play.defined(message);
    const now = JSON.stringify(message);
    if (wasLost) stream.note("The connection is back. What happened meanwhile is not here.");
    wasLost = false;
    components.forget();
    // After an interruption it is mostly the same robot: what a reader has opened and chosen stays.
    if (now !== known) {
      known = now;
      map.clear();
      touch("definition");
    }
    touch("robot", "update", "map", "position", "run");
  },
  update(message) {
    received.update = message;
    received.updateMs = performance.now();
    map.updated();
    orders.updated();
    touch("update", "map");
  },
  events({ entries, lost }) {
    stream.add(entries ?? [], lost ?? 0);
    components.take(entries ?? [], lost ?? 0);
    touch("taken");
  },
  scan(message) {
    received.scan = message;
    touch("map");
  },
  position(message) {
    if (received.position && message.time_s < received.position.time_s) {
      stream.backTo((entry) => entry.time_s > message.time_s);
      map.clear();
    }
    received.position = message;
    touch("position");
  },
  run(message) {
    received.run = message;
    play.reported(message);
    stream.backTo((entry) => entry.number > message.entries);
    touch("run");
  },
  saved: (message) => play.saved(message),
  refused: (message) => (isModel() ? play.refused(message) : orders.answered(message)),
  done: (message) => orders.answered(message),
  gone({ why }) {
    const now = String(why ?? "");
    // The server sends this again and again, as a sign of life.
    if (now !== received.gone) stream.note(`The source is lost: ${now}`);
    received.gone = now;
    wasLost = true;
  },
};

paints("definition", components.build);
paints("definition", requests.build);
paints("definition", goals.build);
paints("definition", map.build);
paints("definition", replay.build);
paints("definition", play.build);
paints("robot", paintRobot);
paints("robot", orders.paint);
paints("update", paintStatus);
paints("update", components.paint);
paints("update", requests.paint);
paints("update", goals.paint);
paints("taken", components.paint);
paints("stream", stream.paint);
paints("map", map.paint);
paints("position", replay.paint);
paints("run", play.paint);

startTheme(() => {
  forgetColours();
  touch("map");
});

const shown = token ? `?token=${encodeURIComponent(token)}` : "";
const streamAddress = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/stream${shown}`;
connection = new Connection(streamAddress, `/places${shown}`, {
  onMessage(message) {
    if (Object.hasOwn(receive, message.type)) receive[message.type](message);
    lookAtFreshness();
  },
  onChange() {
    if (connection === null) return;
    if (!connection.isOpen) play.disconnected();
    if (!connection.isOpen && received.definition !== null) {
      wasLost = true;
      stream.note("The connection is lost.");
    }
    orders.changed();
    lookAtFreshness();
  },
  onLook: () => connection && lookAtFreshness(),
});
lookAtFreshness();
touch("stream", "map");

// The frame around this page cannot see whether it has come.
if (window.parent !== window) window.parent.postMessage("robosc-live-view", "*");
