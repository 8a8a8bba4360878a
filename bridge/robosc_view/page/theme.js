// Light, dark, or as the computer has it.

import { byId, say } from "./dom.js";

const KEPT = "robosc-theme";
const NAMES = ["auto", "light", "dark"];
const WORDS = { auto: "Theme: auto", light: "Theme: light", dark: "Theme: dark" };

/** @param {() => void} onChange Called when colours have changed. */
export function startTheme(onChange) {
  const button = byId("theme");
  let name = kept();
  const use = () => {
    document.documentElement.dataset.theme = name;
    say(button, WORDS[name]);
    onChange();
  };
  button.addEventListener("click", () => {
    name = NAMES[(NAMES.indexOf(name) + 1) % NAMES.length];
    keep(name);
    use();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", onChange);
  use();
}

function kept() {
  try {
    const name = localStorage.getItem(KEPT);
    return NAMES.includes(name) ? name : "auto";
  } catch {
    return "auto";
  }
}

function keep(name) {
  try {
    localStorage.setItem(KEPT, name);
  } catch {
    // The choice lasts as long as the page where storage is forbidden.
  }
}
