// One time for all views: it is set, scrubbed and played in one place, and views follow it.
import { make } from "./dom.js";

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];

export class Clock {
  constructor() {
    Object.assign(this, { t: 0, end: 0, speed: 1, playing: false, views: [] });
  }

  // call a view with the time whenever that changes
  on(view) { this.views.push(view); }

  // the motion has another length
  until(end) {
    this.end = end;
    this.to(Math.min(this.t, end));
  }

  to(t) {
    this.t = Math.min(Math.max(t, 0), this.end);
    for (const view of this.views) view(this.t);
  }

  play(on = !this.playing) {
    this.playing = on && this.end > 0;
    if (this.playing && this.t >= this.end) this.t = 0;
    let before = null;
    const step = (now) => {
      if (!this.playing) return;
      if (before !== null) {
        const t = this.t + (this.speed * (now - before)) / 1000;
        if (t >= this.end) this.playing = false;
        this.to(t);
      }
      before = now;
      if (this.playing) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
    this.to(this.t);
  }
}

// the controls of a clock; said: what there is to say of a time beside it
export const timeBar = (clock, place, said = () => "") => {
  const button = make("button", { type: "button", class: "time-play", onclick: () => clock.play() }, "▶ Play");
  const range = make("input", { type: "range", min: 0, max: 1, step: "any", value: 0, class: "time-scrub", "aria-label": "time" });
  const speed = make("select", { "aria-label": "speed" }, ...SPEEDS.map((each) => make("option", { value: each, selected: each === 1 }, `${each} ×`)));
  const output = make("output", { class: "time-now" });
  range.addEventListener("input", () => clock.to(Number(range.value)));
  range.addEventListener("keydown", (event) => { // a hundredth, or a thousandth of the whole
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    clock.to(clock.t + (step * clock.end) / (event.shiftKey ? 1000 : 100));
  });
  speed.addEventListener("change", () => { clock.speed = Number(speed.value); });
  clock.on((t) => {
    range.max = String(clock.end);
    range.value = String(t);
    button.textContent = clock.playing ? "❚❚ Pause" : "▶ Play";
    const words = said(t);
    output.textContent = `${t.toFixed(3)} of ${clock.end.toFixed(3)} s${words ? `, ${words}` : ""}`;
    range.setAttribute("aria-valuetext", output.textContent);
  });
  place.replaceChildren(button, range, speed, output);
};
