// Numbers and times in words.

const two = (number) => String(number).padStart(2, "0");

/** A time of day with milliseconds, from seconds since 1970. */
export function clock(timeS) {
  const date = new Date(timeS * 1000);
  if (Number.isNaN(date.getTime())) return "--:--:--";
  const ms = String(date.getMilliseconds()).padStart(3, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${ms}`;
}

/** A span as minutes and seconds, with tenths. */
export function span(seconds) {
  const tenths = Math.max(Math.round(seconds * 10), 0);
  const minutes = Math.floor(tenths / 600);
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return `${two(minutes)}:${rest}`;
}

/** Time that has passed, in words. */
export function ago(seconds) {
  if (seconds < 1) return "less than a second";
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h`;
}

/** A number with so many digits after the point; "–" for none. */
export const figure = (number, digits) => (Number.isFinite(number) ? number.toFixed(digits) : "–");

/** A value of the model as text. */
export function value(thing) {
  if (typeof thing === "number" && !Number.isInteger(thing)) return String(Number(thing.toPrecision(6)));
  if (thing !== null && typeof thing === "object") return JSON.stringify(thing);
  return String(thing);
}

const grouped = new Intl.NumberFormat("en");

/** A whole number with its thousands apart. */
export const whole = (number) => grouped.format(number);

/** "1 entry", "2 entries". */
export const count = (number, one, many) => `${whole(number)} ${number === 1 ? one : many}`;
