// The socket to the server: says hello, comes back by itself, and hands each message to who wants its kind.

const tabName = () => {
  let name = sessionStorage.getItem("tab");
  if (!name) {
    name = [...crypto.getRandomValues(new Uint8Array(8))].map((b) => b.toString(16).padStart(2, "0")).join("");
    sessionStorage.setItem("tab", name);
  }
  return name;
};

const LONGEST_PAUSE = 4000; // ms

export class Link {
  constructor() {
    this.listeners = new Map();
    this.tab = tabName();
    this.pause = 250;
    this.open = false;
  }

  on(kind, listener) {
    this.listeners.set(kind, [...(this.listeners.get(kind) ?? []), listener]);
  }

  tell(kind, message) {
    for (const listener of this.listeners.get(kind) ?? []) listener(message);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/socket`);
    this.socket.addEventListener("open", () => {
      this.pause = 250;
      this.open = true;
      this.send({ do: "hello", tab: this.tab });
    });
    this.socket.addEventListener("message", (event) => {
      const message = JSON.parse(event.data);
      this.tell(message.kind, message);
    });
    this.socket.addEventListener("close", () => {
      this.open = false;
      this.tell("lost", {});
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    });
  }

  // whether the message went out
  send(message) {
    if (!this.open) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}
