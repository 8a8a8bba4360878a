// The token that commands need: given with the page, kept for a reload of this tab, and out of the address.

const KEPT = "robosc-token";

/** The token; empty: this page may only watch and stop. */
export function takeToken() {
  const given = document.querySelector('meta[name="robosc-token"]')?.content ?? "";
  const address = new URL(location.href);
  if (address.searchParams.has("token")) {
    // An address is shown, kept in the history and passed on by hand.
    address.searchParams.delete("token");
    history.replaceState(null, "", address);
  }
  try {
    if (given) sessionStorage.setItem(KEPT, given);
    return given || (sessionStorage.getItem(KEPT) ?? "");
  } catch {
    return given;
  }
}
