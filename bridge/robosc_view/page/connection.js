// The WebSocket to the server: comes back by itself, and notices a server that has fallen silent.

export const SILENT_MS = 3000;
const DEAD_MS = 10000;
const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 5000;
const LOOK_EVERY_MS = 250;

export class Connection {
  /**
   * @param {string} address Of the stream.
   * @param {string} places Address that answers whether there is a place for a stream.
   * @param {{onMessage: (message: object) => void, onChange: () => void, onLook: () => void}} handlers Called for each
   *   message, for each change of `isOpen`, and several times a second.
   */
  constructor(address, places, handlers) {
    this.address = address;
    this.places = places;
    this.handlers = handlers;
    this.isOpen = false;
    this.isFull = false;
    this.heardMs = performance.now();
    this.waitMs = FIRST_WAIT_MS;
    this.timer = null;
    this.socket = null;
    setInterval(() => this.poll(), LOOK_EVERY_MS);
    window.addEventListener("online", () => this.hurry());
    document.addEventListener("visibilitychange", () => document.hidden || this.hurry());
    this.open();
  }

  /** Milliseconds since the server's last message, or since the page was opened. */
  get silenceMs() {
    return performance.now() - this.heardMs;
  }

  /** Sends a message; false: there is no connection. */
  send(message) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  open() {
    this.timer = null;
    const socket = new WebSocket(this.address);
    this.socket = socket;
    this.openedMs = performance.now();
    socket.onopen = () => this.changed(socket, true);
    socket.onclose = () => this.closed(socket);
    socket.onmessage = (event) => this.received(socket, event.data);
  }

  changed(socket, isOpen) {
    if (socket !== this.socket) return;
    this.isOpen = isOpen;
    if (isOpen) {
      this.openedMs = performance.now();
      this.isFull = false;
    }
    this.handlers.onChange();
  }

  closed(socket) {
    if (socket !== this.socket) return;
    this.socket = null;
    if (this.isOpen) this.changed(null, false);
    else void this.askPlaces();
    this.timer = setTimeout(() => this.open(), this.waitMs);
    this.waitMs = Math.min(this.waitMs * 2, LONGEST_WAIT_MS);
  }

  /** Asks whether the server is full: a browser does not report why a stream did not open. */
  async askPlaces() {
    try {
      this.isFull = (await fetch(this.places)).status === 503 && !this.isOpen;
    } catch {
      this.isFull = false;
    }
    this.handlers.onLook();
  }

  received(socket, data) {
    if (socket !== this.socket || typeof data !== "string") return;
    this.heardMs = performance.now();
    this.waitMs = FIRST_WAIT_MS;
    let message = null;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (message !== null && typeof message === "object") this.handlers.onMessage(message);
  }

  poll() {
    const socket = this.socket;
    const since = performance.now() - Math.max(this.heardMs, this.openedMs);
    if (socket !== null && since > DEAD_MS) {
      // A closing handshake with a dead server would take long: it is given up here and now.
      this.closed(socket);
      socket.close();
    }
    this.handlers.onLook();
  }

  hurry() {
    if (this.timer === null) return;
    clearTimeout(this.timer);
    this.open();
  }
}
