// Playback in real time: the rows that a controller would get, with its override and its hold.
import { $, show } from "./dom.js";

export class Play {
  constructor(link, settings, picture) {
    Object.assign(this, { link, settings, picture, on: false, held: false, back: false });
    $("play").addEventListener("click", () => this.start());
    $("hold").addEventListener("click", () => this.hold(!this.held));
    $("back").addEventListener("click", () => { this.back = !this.back; this.order({ reverse: this.back }); this.buttons(); });
    $("stop").addEventListener("click", () => this.order({ stop: true }));
    $("override").addEventListener("input", () => {
      $("override-value").textContent = `${$("override").value} %`;
      this.order({ override: this.rate() });
    });
    link.on("playing", ({ words }) => { $("play-state").textContent = `${words} ...`; });
    link.on("frame", (frame) => this.frame(frame));
    link.on("played", (message) => this.ended(message));
    link.on("lost", () => this.reset());
    this.reset();
  }

  rate() { return Number($("override").value); }

  order(said) {
    if (this.on) this.link.send({ do: "order", ...said });
  }

  ready() { $("play").disabled = this.on; }

  start() {
    this.on = true;
    this.picture.move(null);
    this.buttons();
    $("play-state").textContent = "begins ...";
    this.link.send({ do: "play", settings: this.settings.value, top: Number($("top").value), override: this.rate() });
  }

  hold(held) {
    this.held = held;
    this.order({ hold: held });
    this.buttons();
  }

  buttons() {
    $("play").disabled = $("top").disabled = this.on;
    $("hold").disabled = $("back").disabled = $("stop").disabled = !this.on;
    $("back").setAttribute("aria-pressed", String(this.back));
    $("hold").setAttribute("aria-pressed", String(this.held));
    $("hold").textContent = this.held ? "Resume" : "Feed hold";
  }

  frame(frame) {
    const { position, picture } = { position: frame.position, picture: this.picture };
    picture.move(picture.points.overTime ? [frame.tau_s, position[0], 0] : [position[0], position[1], position[2] ?? 0]);
    const parts = [`plan time ${frame.tau_s.toFixed(2)} of ${frame.planned_s.toFixed(2)} s`, `s ${frame.s_mm.toFixed(2)} mm`, `rate ${(100 * frame.rate).toFixed(0)} %`];
    if (frame.wanted > frame.top) parts.push(`the limits allow ${(100 * frame.top).toFixed(0)} %`);
    $("play-state").textContent = parts.join(", ");
    document.body.dataset.row = String(frame.row);
  }

  ended({ answer, error }) {
    this.reset();
    if (error) { $("play-state").textContent = Object.values(error.fields).join("; "); return; }
    const where = answer.done ? "played to the end" : `stopped at plan time ${answer.tau_s.toFixed(2)} s`;
    $("play-state").textContent = `${where}: ${answer.rows} rows, ${answer.underruns} late`;
    document.body.dataset.played = String(answer.rows);
  }

  reset() {
    this.on = this.held = this.back = false;
    show($("play-state"), true);
    this.buttons();
    $("play").disabled = !this.picture.points;
  }
}
