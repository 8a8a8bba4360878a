// The event stream as a list that is bounded, and what a filter leaves of it. Knows nothing of the document.

export const LIMIT = 20000;
const SLACK = 1000;

/** Choice of the entries that are wanted. */
export class Filter {
  constructor() {
    this.text = "";
    this.hidden = new Set();
  }

  /** Returns true if an entry is shown; what was lost always is. */
  takes(entry) {
    if (entry.kind === "lost") return true;
    if (this.hidden.has(groupOf(entry))) return false;
    return this.text === "" || entry.searched.includes(this.text);
  }
}

/** Group by which an entry is switched on and off: its kind; events by whether they are controllable. */
export function groupOf(entry) {
  if (entry.kind !== "event") return String(entry.kind);
  return entry.controllable ? "controllable" : "uncontrollable";
}

export class Entries {
  constructor(limit = LIMIT) {
    this.limit = limit;
    this.filter = new Filter();
    this.clear();
  }

  /** Forgets everything. */
  clear() {
    this.all = [];
    this.shown = [];
    this.released = 0;
    this.lost = 0;
    this.frozen = null;
    this.waiting = 0;
    this.highest = -Infinity;
    this.serial = 0;
  }

  get isPaused() {
    return this.frozen !== null;
  }

  /** Adds entries; each is kept once, in its order. Returns by how many `shown` was cut at its beginning. */
  add(entries) {
    for (const entry of entries) this.addOne(entry);
    return this.trim();
  }

  addOne(entry) {
    const serial = this.serial;
    this.serial += 1;
    const kept = { ...entry, serial, searched: searchedText(entry) };
    this.all.push(kept);
    if (typeof entry.number === "number") this.highest = Math.max(this.highest, entry.number);
    if (this.isPaused) this.waiting += 1;
    else if (this.filter.takes(kept)) this.shown.push(kept);
  }

  /** Notes in the stream that so many entries are missing here. */
  addLost(count, timeS) {
    this.lost += count;
    const text = `${count} ${count === 1 ? "entry was" : "entries were"} lost: they came too quickly`;
    return this.add([{ kind: "lost", time_s: timeS, text }]);
  }

  /** Takes back what `isGone` says, after a jump back in time. */
  takeBack(isGone) {
    this.all = this.all.filter((entry) => !isGone(entry));
    this.highest = this.all.reduce((most, entry) => Math.max(most, entry.number ?? -Infinity), -Infinity);
    this.select();
  }

  trim() {
    if (this.all.length <= this.limit + SLACK) return 0;
    const excess = this.all.length - this.limit;
    this.released += excess;
    this.all = this.all.slice(excess);
    const first = this.all[0].serial;
    // Entries that are shown in a pause stay; they are no more than at its beginning.
    if (this.isPaused) return 0;
    const cut = this.shown.findIndex((entry) => entry.serial >= first);
    const gone = cut < 0 ? this.shown.length : cut;
    this.shown = this.shown.slice(gone);
    return gone;
  }

  pause() {
    this.frozen = this.serial;
    this.waiting = 0;
  }

  resume() {
    this.frozen = null;
    this.waiting = 0;
    this.select();
  }

  /** Goes through the filter again. */
  select() {
    const end = this.frozen ?? Infinity;
    this.shown = this.all.filter((entry) => entry.serial < end && this.filter.takes(entry));
  }
}

function searchedText(entry) {
  return `${entry.kind} ${entry.event ?? ""} ${entry.text ?? ""}`.toLowerCase();
}
