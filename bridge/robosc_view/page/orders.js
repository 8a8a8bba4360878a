// The stop button, and the commands of whoever has the token. Each press says what became of it.

import { announce } from "./announce.js";
import { byId, make, mark, say, show } from "./dom.js";
import { isModel, isReplay, received } from "./received.js";

/** On the page, and before a graph in full size, which covers it. */
const STOPS = ["stop", "large-stop"];
const ANSWERS = ["stop-answer", "large-answer"];

const HEARD_WITHIN_MS = 2000;
const SWITCH = "Use the switch on the robot.";

/**
 * @param {() => import("./connection.js").Connection} connection The connection.
 * @param {string} token Token that commands need; empty: there is none.
 * @returns {{paint: () => void, answered: (message: object) => void, updated: () => void, changed: () => void}} To be
 *   called for a new definition, an answer, an update, and a change of the connection.
 */
export function startOrders(connection, token) {
  /** Orders that wait for their answers: the timer of each by its name, null once it is late. */
  const waiting = new Map();
  let isOwed = false;

  const answer = (kind, sentence) => {
    for (const place of ANSWERS.map(byId)) {
      mark(place, "data-kind", kind);
      // A new element, so that a sentence that comes twice is shown and read twice.
      place.replaceChildren(make("span", {}, sentence));
    }
    announce("answer", sentence);
  };

  const order = (what, message) => {
    clearTimeout(waiting.get(what));
    waiting.set(what, setTimeout(() => unanswered(what), HEARD_WITHIN_MS));
    answer("sent", what === "stop" ? "Stop sent…" : `${what}: sent…`);
    return connection().send(message);
  };

  // An order that was not answered in time may be answered later.
  const unanswered = (what) => {
    waiting.set(what, null);
    answer("bad", what === "stop" ? `STOP was not confirmed within 2 s. ${SWITCH}` : `${what}: no answer within 2 s.`);
  };

  const done = (what) => {
    if (!waiting.has(what)) return false;
    clearTimeout(waiting.get(what));
    return waiting.delete(what);
  };

  const stop = () => {
    if (byId("stop").hidden) return;
    flash();
    if (order("stop", { type: "stop" })) return;
    done("stop");
    isOwed = true;
    answer("bad", `STOP was NOT sent: there is no connection. ${SWITCH} It is sent as soon as the connection is back.`);
  };

  for (const button of STOPS.map(byId)) button.addEventListener("click", stop);
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.key === "Escape" && !event.repeat) stop();
    },
    // Before any other part of the page can keep the key for itself.
    { capture: true },
  );

  const buttons = [...document.querySelectorAll("[data-command]")];
  for (const button of buttons) {
    const command = button.dataset.command;
    button.addEventListener("click", () => {
      if (order(command, { type: "command", command, token })) return;
      done(command);
      answer("bad", `${command}: not sent, there is no connection.`);
    });
  }

  return {
    paint() {
      const { definition } = received;
      const canCommand = definition?.can_command === true;
      for (const button of STOPS.map(byId)) show(button, canCommand);
      show(byId("commands"), canCommand && token !== "");
      say(byId("commands-why"), whyNoCommands(definition, canCommand, token));
      show(byId("commands-why"), byId("commands-why").textContent !== "");
    },
    answered(message) {
      if (message.type === "refused") {
        done(message.what);
        answer("bad", `${message.what}: refused. ${message.why}`);
      } else if (done(message.what)) {
        answer("good", message.what === "stop" ? "STOP was heard." : `${message.what}: done.`);
      }
    },
    updated() {
      const isStopped = (received.update?.reasons ?? []).some((reason) => /operator_?stop/i.test(String(reason.code)));
      if (isStopped && done("stop")) answer("good", "STOP was heard: the robot is stopped by an operator.");
    },
    changed() {
      if (!connection().isOpen || !isOwed) return;
      isOwed = false;
      order("stop", { type: "stop" });
    },
  };
}

function flash() {
  for (const button of STOPS.map(byId)) {
    button.classList.add("is-pressed");
    setTimeout(() => button.classList.remove("is-pressed"), 200);
  }
}

function whyNoCommands(definition, canCommand, token) {
  if (definition === null) return "";
  if (isModel()) return "A model alone: you lead it by hand, and nothing is executed.";
  if (isReplay()) return "A recorded run: nothing here moves a robot.";
  if (!canCommand) return "This view only watches: it can neither stop nor command the robot.";
  return token ? "" : "Start, standby, resume and reset need the address with the token that the server printed. Stop works without.";
}
