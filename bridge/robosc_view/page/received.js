// Data that the server has sent last. Parts of the page read it; main.js alone writes it.

/** Data that the server has sent last; null: nothing was sent. */
export const received = {
  /** The `definition`; null: not yet. */
  definition: null,
  /** The latest `update`; null: not yet. */
  update: null,
  /** Time at which it came, in milliseconds, by performance.now(). */
  updateMs: 0,
  /** The latest `scan`. */
  scan: null,
  /** The latest `position` of a replay. */
  position: null,
  /** The latest `run` of a model that is played with. */
  run: null,
  /** Reason why the source is lost; null: it is not. */
  gone: null,
};

/** Forgets the data about the robot, for a new definition. */
export function forget() {
  Object.assign(received, { update: null, updateMs: 0, scan: null, position: null, run: null, gone: null });
}

/** Value that a received object has under a name; undefined: none, even if every object inherits one of that name. */
export const under = (object, name) => (Object.hasOwn(object, name) ? object[name] : undefined);

/** Returns true if a recorded run is shown. */
export const isReplay = () => received.definition?.source === "log";

/** Returns true if nothing is executed: a model that is played with. */
export const isModel = () => received.definition?.source === "model";

/** Returns true if what is played with are automata without a model of RoboSC. */
export const isAutomata = () => received.definition?.deployment === "automata";

/** Age of the state that is shown, in seconds. */
export function ageS() {
  if (received.update === null) return 0;
  return (received.update.age_s ?? 0) + (performance.now() - received.updateMs) / 1000;
}
