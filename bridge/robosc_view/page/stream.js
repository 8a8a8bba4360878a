// The event stream: of many thousand entries only the rows in view are in the document.

import { byId, make, mark, quoted, say, show } from "./dom.js";
import { Entries, groupOf } from "./entries.js";
import { clock, count, whole } from "./format.js";
import { afterPainting, touch } from "./frame.js";
import { isModel, isReplay } from "./received.js";

const OVERSCAN = 6;
const FIRST_KINDS = ["controllable", "uncontrollable"];
const SIGNS = { __proto__: null, controllable: "◆", uncontrollable: "○", fault: "✕", blocked: "■", stop: "■", cancel_overdue: "▲", lost: "▲", connection: "▲" };

/** @returns {object} Functions that main.js calls. */
export function startStream() {
  const entries = new Entries();
  const box = byId("stream");
  const place = byId("stream-rows");
  const spacer = byId("stream-space");
  const rows = new Map();
  const kinds = new Map();
  let isFollowing = true;
  let selected = null;
  let shiftRows = 0;

  // Asked of the document only when they may have changed, since each question makes it lay itself out.
  let rowHeight = 25;
  let boxHeight = 0;
  let top = 0;
  const measure = () => {
    rowHeight = Number.parseFloat(getComputedStyle(box).getPropertyValue("--row")) || 25;
    boxHeight = box.clientHeight;
    top = box.scrollTop;
  };
  measure();
  const scrollTo = (wanted) => {
    top = Math.max(Math.min(wanted, entries.shown.length * rowHeight - boxHeight), 0);
    // The rows of the place are there first, and room for them.
    afterPainting(box, () => {
      box.scrollTop = top;
    });
  };

  const change = () => touch("stream");
  const added = (cut) => {
    shiftRows += cut;
    change();
  };

  const addKind = (group) => {
    if (group === "lost" || kinds.has(group)) return;
    // Kinds are few; if a robot makes up many, they are shown without a switch.
    if (kinds.size >= 24) return;
    const input = make("input", { type: "checkbox", checked: true });
    input.addEventListener("change", () => {
      if (input.checked) entries.filter.hidden.delete(group);
      else entries.filter.hidden.add(group);
      entries.select();
      change();
    });
    const sign = SIGNS[group] ? make("span", { class: `mark is-${FIRST_KINDS.includes(group) ? group : "other"}`, "aria-hidden": "true" }, SIGNS[group]) : "";
    kinds.set(group, input);
    byId("stream-kinds").append(make("label", { class: "kind" }, input, sign, quoted(group)));
  };
  FIRST_KINDS.forEach(addKind);

  const makeRow = (entry) => {
    const group = groupOf(entry);
    const row = make("div", {
      class: "row", role: "option", id: `entry-${entry.serial}`, "data-group": SIGNS[group] ? group : "other",
      "data-number": entry.number ?? "", "aria-selected": "false",
    },
      make("time", {}, clock(entry.time_s)), make("span", { class: "row-sign", role: "img", "aria-label": group }, SIGNS[group] ?? "·"),
      quoted(entry.event || entry.kind, "row-event"), quoted(entry.text ?? "", "row-text"));
    row.addEventListener("click", () => select(entry));
    return row;
  };

  const select = (entry) => {
    selected = entry;
    const detail = byId("stream-detail");
    detail.replaceChildren(make("b", {}, clock(entry.time_s)), " ", quoted(groupOf(entry)), " ", quoted(entry.event || "", "row-event"), " ", quoted(entry.text ?? ""));
    show(detail, true);
    change();
  };

  const move = (step) => {
    const { shown } = entries;
    if (shown.length === 0) return;
    const at = selected === null ? -1 : indexOf(shown, selected);
    // From nothing, or from what a filter hides, one begins at what is in view.
    const from = at >= 0 ? at + step : Number.isFinite(step) ? Math.floor(top / rowHeight) : step;
    const next = Math.min(Math.max(from, 0), shown.length - 1);
    select(shown[next]);
    if (next * rowHeight < top) scrollTo(next * rowHeight);
    else if ((next + 1) * rowHeight > top + boxHeight) scrollTo((next + 1) * rowHeight - boxHeight);
    isFollowing = next === shown.length - 1;
  };

  box.addEventListener("keydown", (event) => {
    const page = Math.max(Math.floor(boxHeight / rowHeight) - 1, 1);
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    if (!(event.key in steps) || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    move(steps[event.key]);
  });

  box.addEventListener("scroll", () => {
    // Positions that the page has set itself are painted already.
    if (Math.abs(box.scrollTop - top) < 1) return;
    top = box.scrollTop;
    isFollowing = top + boxHeight >= Number.parseFloat(spacer.style.height) - rowHeight;
    change();
  }, { passive: true });
  new ResizeObserver(() => {
    measure();
    change();
  }).observe(box);

  byId("stream-filter").addEventListener("input", (event) => {
    entries.filter.text = event.target.value.trim().toLowerCase();
    entries.select();
    change();
  });
  byId("stream-pause").addEventListener("click", () => {
    if (entries.isPaused) entries.resume();
    else entries.pause();
    change();
  });
  byId("stream-latest").addEventListener("click", () => {
    isFollowing = true;
    change();
  });
  byId("stream-clear").addEventListener("click", () => {
    entries.clear();
    selected = null;
    show(byId("stream-detail"), false);
    change();
  });
  byId("stream-save").addEventListener("click", () => save(entries.all));

  // Jump in a recorded run: after a jump back, entries that come again replace those that were there; after a jump
  // ahead, the stream begins anew with the entries that the server sends of the time before.
  const jumpTo = (first) => {
    if (first.number <= entries.highest) entries.takeBack((entry) => entry.number >= first.number);
    if (isModel()) return;
    const before = first.number - 1 - Math.max(entries.highest, 0);
    if (before <= 0) return;
    entries.clear();
    entries.add([{ kind: "lost", time_s: first.time_s, text: `The replay jumped here: ${count(first.number - 1, "entry", "entries")} before it` }]);
  };

  const paintRows = () => {
    const { shown } = entries;
    spacer.style.height = `${shown.length * rowHeight}px`;
    if (isFollowing && !entries.isPaused) scrollTo(Infinity);
    else if (shiftRows > 0) scrollTo(top - shiftRows * rowHeight);
    shiftRows = 0;
    const first = Math.max(Math.floor(top / rowHeight) - OVERSCAN, 0);
    const last = Math.min(Math.ceil((top + boxHeight) / rowHeight) + OVERSCAN, shown.length);
    const wanted = new Set();
    for (let i = first; i < last; i += 1) wanted.add(shown[i].serial);
    for (const [serial, row] of rows) {
      if (wanted.has(serial)) continue;
      row.remove();
      rows.delete(serial);
    }
    for (let i = first; i < last; i += 1) {
      const entry = shown[i];
      const row = rows.get(entry.serial) ?? makeRow(entry);
      if (!row.isConnected) {
        rows.set(entry.serial, row);
        place.append(row);
      }
      row.style.top = `${i * rowHeight}px`;
      mark(row, "aria-posinset", i + 1);
      mark(row, "aria-setsize", shown.length);
      mark(row, "aria-selected", entry === selected);
    }
    if (selected !== null && wanted.has(selected.serial)) mark(box, "aria-activedescendant", `entry-${selected.serial}`);
    else box.removeAttribute("aria-activedescendant");
  };

  const paintWords = () => {
    const { all, shown, isPaused, waiting, lost, released } = entries;
    const isNarrowed = shown.length !== all.length && !isPaused;
    say(byId("stream-count"), isNarrowed ? `${count(shown.length, "entry", "entries")} of ${whole(all.length)}` : count(shown.length, "entry", "entries"));
    const pause = byId("stream-pause");
    mark(pause, "aria-pressed", isPaused);
    say(pause, isPaused ? `Go on (${whole(waiting)} new)` : "Pause");
    show(byId("stream-latest"), !isFollowing && !isPaused);
    const missing = [
      lost > 0 ? `${count(lost, "entry was", "entries were")} lost on the way: they came too quickly.` : "",
      released > 0 ? `The oldest ${count(released, "entry is", "entries are")} not kept any more.` : "",
    ].filter(Boolean).join(" ");
    say(byId("stream-lost"), missing);
    show(byId("stream-lost"), missing !== "");
  };

  return {
    /** Entries of a batch; before them `lost` are missing. */
    add(batch, lost) {
      if ((isReplay() || isModel()) && batch.length > 0) jumpTo(batch[0]);
      if (lost > 0) added(entries.addLost(lost, batch[0]?.time_s ?? Date.now() / 1000));
      for (const entry of batch) addKind(groupOf(entry));
      added(entries.add(batch));
    },
    /** A line of the page's own, such as that the connection was lost. */
    note(text) {
      addKind("connection");
      added(entries.add([{ kind: "connection", time_s: Date.now() / 1000, text }]));
    },
    /** The run was turned back: entries are gone. */
    backTo(isGone) {
      if (!entries.all.some(isGone)) return;
      entries.takeBack(isGone);
      change();
    },
    clear() {
      entries.clear();
      change();
    },
    paint() {
      paintRows();
      paintWords();
    },
  };
}

function indexOf(shown, entry) {
  // Serials ascend.
  let low = 0;
  let high = shown.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (shown[middle].serial < entry.serial) low = middle + 1;
    else high = middle;
  }
  return shown[low] === entry ? low : -1;
}

function save(all) {
  const lines = all.map(({ serial, searched, ...entry }) => `${JSON.stringify(entry)}\n`);
  const link = make("a", { href: URL.createObjectURL(new Blob(lines, { type: "application/jsonl" })), download: "events.jsonl" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
