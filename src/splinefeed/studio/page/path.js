// The picture of the path: coloured by what is chosen, with hover, control points to drag, and the tool when it plays.
import { $, numbersOf, options, show } from "./dom.js";
import { colours, shade } from "./dress.js";
import { MARGIN, View, ticks } from "./view.js";

const SHADES = 64;
const NEAR = 14; // pixels within which a point is meant

export class PathPicture {
  constructor() {
    this.canvas = $("path");
    this.view = new View();
    this.points = null;
    this.still = document.createElement("canvas");
    this.version = 0;
    this.editor = null; // takes over drags where control points are edited
    this.tool = null;
    this.trail = [];
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    $("fit").addEventListener("click", () => { this.fit(); this.draw(); });
    $("colour").addEventListener("change", () => this.draw());
    this.listen();
  }

  // program: whose lines the points are, if they are a program's
  set(path, axes, program = null) {
    const other = this.program !== program;
    this.program = program;
    const picture = path.data.find((each) => each.customdata);
    const before = this.points;
    this.points = { x: numbersOf(picture.x), y: numbersOf(picture.y), z: picture.z ? numbersOf(picture.z) : null, overTime: false };
    this.said = picture.customdata;
    this.version += 1;
    const shown = Object.values(path.colours)[0].values; // rapid moves may lead far away
    this.ends = ["x", "y", "z"].map((name) => (this.points[name] ?? [0]).reduce(([low, high], value, k) => (program && shown[k] === null ? [low, high] : [Math.min(low, value), Math.max(high, value)]), [Infinity, -Infinity]));
    const parts = Object.keys(path.colours).length === 1; // while something moves; the others follow when it rests
    this.colours = parts ? { ...this.colours, ...path.colours } : path.colours;
    this.axes = axes;
    const title = (axis) => path.layout[axis]?.title?.text ?? path.layout.scene?.[axis]?.title?.text ?? "";
    this.labels = [title("xaxis"), title("yaxis"), path.space ? title("zaxis") : ""];
    this.points.overTime = this.labels[0].startsWith("time");
    const names = Object.keys(this.colours);
    const chosen = !other && names.includes($("colour").value) ? $("colour").value : names[0];
    if (names.join() !== [...$("colour").options].map((each) => each.value).join()) options($("colour"), names.map((name) => [name, name]), chosen);
    const turned = this.view.space !== path.space || !before;
    this.view.space = path.space;
    if (turned || other || this.view.fitWhole) this.fit();
    this.draw();
  }

  fit() {
    if (!this.points || !this.width) return;
    const more = this.editor?.curves.flatMap((curve) => curve.control_points) ?? [];
    if (this.view.space || this.program) { // the corners of its box
      const part = (axis) => [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => this.ends[axis][(bits >> axis) & 1]);
      this.view.fit({ x: part(0), y: part(1), z: part(2) }, this.width, this.height);
      return;
    }
    const { x, y, z, overTime } = this.points;
    const all = more.length ? { x: [...x, ...more.map((p) => p[0])], y: [...y, ...more.map((p) => p[1])], z: null, overTime } : { x, y, z, overTime };
    this.view.fit(all, this.width, this.height);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const ratio = window.devicePixelRatio || 1;
    this.width = width; this.height = height;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.pen = this.canvas.getContext("2d");
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.points) { if (this.view.fitWhole) this.fit(); this.draw(); }
  }

  at(k) {
    return this.view.screen(this.points.x[k], this.points.y[k], this.points.z ? this.points.z[k] : 0);
  }

  draw() {
    if (!this.points || !this.width || this.asked) return;
    this.asked = requestAnimationFrame(() => { this.asked = 0; this.paint(); });
  }

  paint() {
    const { pen, width, height, view } = this;
    const theme = colours();
    // the path stays while the tool plays on it or another line is chosen: it may have a hundred thousand points
    const seen = JSON.stringify([this.version, $("colour").value, theme, width, height, view]);
    if (seen !== this.seen) this.paintPath(theme);
    this.seen = seen;
    pen.clearRect(0, 0, width, height);
    pen.drawImage(this.still, 0, 0, width, height);
    pen.save();
    this.clip();
    if (this.editor) this.editor.paint(pen, view, theme);
    if (this.program?.line) this.paintLine(this.program.line);
    if (!this.program) this.paintTool(theme);
    pen.restore();
  }

  clip() {
    const { pen, width, height } = this;
    pen.beginPath();
    pen.rect(MARGIN.left, MARGIN.top, width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom);
    pen.clip();
  }

  // axes, path and scale, and a copy of them
  paintPath(theme) {
    const { pen, canvas, width, height } = this;
    this.ramp = Array.from({ length: SHADES }, (_, k) => shade(k / (SHADES - 1)));
    const chosen = this.colours[$("colour").value];
    pen.clearRect(0, 0, width, height);
    pen.font = "12px system-ui, sans-serif";
    this.grid(theme);
    pen.save();
    this.clip();
    this.curve(chosen, theme);
    pen.restore();
    this.bar(chosen, theme);
    const first = this.said[0], last = this.said[this.said.length - 1];
    const range = this.program ? "" : `, from s = ${first[1].toFixed(2)} to ${last[1].toFixed(2)} mm`;
    canvas.setAttribute("aria-label", `the path over ${this.labels.filter(Boolean).join(", ")}${range}, coloured by ${chosen.label} from ${chosen.low.toPrecision(3)} to ${chosen.high.toPrecision(3)}`);
    Object.assign(this.still, { width: canvas.width, height: canvas.height });
    this.still.getContext("2d").drawImage(canvas, 0, 0);
  }

  curve(chosen, theme) {
    const { pen, points } = this;
    const count = points.x.length;
    const level = (k) => {
      const value = chosen.values[k];
      return value === null ? -1 : Math.round((SHADES - 1) * Math.min(Math.max((value - chosen.low) / (chosen.high - chosen.low || 1), 0), 1));
    };
    pen.lineJoin = "round"; pen.lineCap = "round";
    pen.lineWidth = 5; pen.strokeStyle = theme.faint; // an edge, where a shade is near the paper's
    pen.beginPath();
    for (let k = 0; k < count; k++) if (chosen.values[k] === null) pen.moveTo(...this.at(k)); else pen.lineTo(...this.at(k));
    pen.stroke();
    let [x, y] = this.at(0);
    let k = 1;
    while (k < count) {
      const shared = level(k);
      pen.lineWidth = shared < 0 ? 1 : 3.2;
      pen.strokeStyle = shared < 0 ? theme.faint : this.ramp[shared];
      pen.beginPath();
      pen.moveTo(x, y);
      do {
        [x, y] = this.at(k);
        pen.lineTo(x, y);
        k += 1;
      } while (k < count && level(k) === shared);
      pen.stroke();
    }
    const ends = [["start", 0], ["end", count - 1]];
    const closed = Math.hypot(this.at(0)[0] - this.at(count - 1)[0], this.at(0)[1] - this.at(count - 1)[1]) < 12;
    for (const [name, at] of closed ? [["start, end", 0]] : ends) {
      const [px, py] = this.at(at);
      pen.fillStyle = theme.ink;
      pen.beginPath(); pen.arc(px, py, 4.5, 0, 2 * Math.PI); pen.fill();
      const left = px > this.width - MARGIN.right - 44;
      pen.textAlign = left ? "right" : "left";
      pen.fillText(name, px + (left ? -8 : 8), py - 8);
      pen.textAlign = "left";
    }
  }

  grid(theme) {
    const { pen, width, height, view } = this;
    const [left, right, top, bottom] = [MARGIN.left, width - MARGIN.right, MARGIN.top, height - MARGIN.bottom];
    pen.fillStyle = theme.faint; pen.strokeStyle = theme.line; pen.lineWidth = 1;
    if (view.space) { this.box(theme); return; }
    const [x0, y0] = view.place(left, bottom);
    const [x1, y1] = view.place(right, top);
    const horizontal = ticks(x0, x1, (right - left) / 90), vertical = ticks(y0, y1, (bottom - top) / 60);
    pen.textAlign = "center"; pen.textBaseline = "top";
    for (const value of horizontal.at) {
      const [px] = view.screen(value, 0, 0);
      pen.beginPath(); pen.moveTo(px, top); pen.lineTo(px, bottom); pen.stroke();
      pen.fillText(horizontal.text(value), px, bottom + 6);
    }
    pen.fillText(this.labels[0], (left + right) / 2, bottom + 22);
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const value of vertical.at) {
      const [, py] = view.screen(0, value, 0);
      pen.beginPath(); pen.moveTo(left, py); pen.lineTo(right, py); pen.stroke();
      pen.fillText(vertical.text(value), left - 6, py);
    }
    pen.save();
    pen.translate(14, (top + bottom) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center";
    pen.fillText(this.labels[1], 0, 0);
    pen.restore();
    pen.textAlign = "left"; pen.textBaseline = "alphabetic";
  }

  // the box around a path in space: its edges, and what it measures along those that are in front
  box(theme) {
    const { pen, view } = this;
    const corner = (bits) => this.ends.map((end, axis) => end[(bits >> axis) & 1]);
    const at = (bits) => view.screen(...corner(bits));
    pen.strokeStyle = theme.line;
    pen.beginPath();
    for (const axis of [0, 1, 2]) for (let bits = 0; bits < 8; bits++) if (!(bits & (1 << axis))) { pen.moveTo(...at(bits)); pen.lineTo(...at(bits | (1 << axis))); }
    pen.stroke();
    pen.textBaseline = "middle";
    const middle = (bits, axis, k) => (at(bits)[k] + at(bits | (1 << axis))[k]) / 2;
    for (const axis of [0, 1, 2]) {
      const edges = [0, 1, 2, 3, 4, 5, 6, 7].filter((bits) => !(bits & (1 << axis)));
      // lowest on the screen for x and y, leftmost for z
      const front = edges.reduce((best, bits) => ((axis < 2 ? middle(bits, axis, 1) > middle(best, axis, 1) + 1e-6 : middle(bits, axis, 0) < middle(best, axis, 0) - 1e-6) ? bits : best));
      const upper = at(at(front)[1] < at(front | 4)[1] ? front : front | 4);
      const [px, py] = axis < 2 ? [middle(front, axis, 0), middle(front, axis, 1)] : upper;
      const left = axis === 2 || px < view.centre[0];
      const [low, high] = this.ends[axis].map((value) => String(Number(value.toPrecision(5))));
      const words = `${this.labels[axis].split(" ")[0]} ${low} to ${high}`;
      const wide = pen.measureText(words).width; // no label leaves the picture
      pen.fillText(words, left ? Math.max(px - 8 - wide, 4) : Math.min(px + 8, this.width - MARGIN.right - wide), py + (axis < 2 ? 12 : -9));
    }
    pen.textBaseline = "alphabetic";
  }

  bar(chosen, theme) {
    const { pen, width, height } = this;
    const [left, top, tall] = [width - MARGIN.right + 14, MARGIN.top + 8, height - MARGIN.top - MARGIN.bottom - 16];
    this.ramp.forEach((colour, k) => {
      pen.fillStyle = colour;
      pen.fillRect(left, top + tall * (1 - (k + 1) / SHADES), 12, tall / SHADES + 1);
    });
    pen.fillStyle = theme.faint;
    pen.textAlign = "left"; pen.textBaseline = "middle";
    const names = this.program?.names(chosen);
    const marks = names ? { at: names.map((_, k) => k).filter((k) => k >= chosen.low), text: (k) => names[k] } : ticks(chosen.low, chosen.high || 1, Math.max(tall / 60, 2));
    for (const value of marks.at) {
      const share = (value - chosen.low) / (chosen.high - chosen.low || 1);
      pen.fillText(marks.text(value), left + 16, top + tall * (1 - share));
    }
    pen.save();
    pen.translate(width - 8, top + tall / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center";
    pen.fillText(chosen.label, 0, 0);
    pen.restore();
    pen.textBaseline = "alphabetic";
  }

  // the moves of a line of the program
  paintLine(line) {
    const { pen } = this;
    pen.strokeStyle = pen.fillStyle = "#d55e00"; pen.lineWidth = 6;
    pen.beginPath();
    for (let k = 1; k < this.said.length; k++) if (this.said[k][0] === line) { pen.moveTo(...this.at(k - 1)); pen.lineTo(...this.at(k)); }
    pen.stroke();
    const [px, py] = this.view.screen(...this.program.place);
    pen.beginPath(); pen.arc(px, py, 6, 0, 2 * Math.PI); pen.fill();
  }

  // where the tool is, and where it has been, as [x, y, z] in mm
  move(position) {
    if (position) { this.tool = position; this.trail.push(position); } else { this.tool = null; this.trail = []; }
    this.draw();
  }

  paintTool(theme) {
    if (!this.tool) return;
    const { pen, view } = this;
    pen.strokeStyle = theme.ink; pen.lineWidth = 1.2;
    pen.beginPath();
    this.trail.forEach((each, k) => { const [px, py] = view.screen(...each); if (k) pen.lineTo(px, py); else pen.moveTo(px, py); });
    pen.stroke();
    const [px, py] = view.screen(...this.tool);
    pen.fillStyle = "#d55e00"; pen.strokeStyle = theme.paper; pen.lineWidth = 2;
    pen.beginPath(); pen.arc(px, py, 7, 0, 2 * Math.PI); pen.fill(); pen.stroke();
  }

  nearest(px, py) {
    let [best, away] = [-1, NEAR * NEAR];
    for (let k = 0; k < this.points.x.length; k++) {
      const [x, y] = this.at(k);
      const d = (x - px) ** 2 + (y - py) ** 2;
      if (d < away) { away = d; best = k; }
    }
    return best;
  }

  hover(px, py) {
    const k = this.points ? this.nearest(px, py) : -1;
    show($("hover"), k >= 0);
    if (k < 0) return;
    const chosen = this.colours[$("colour").value];
    const place = ["x", "y", "z"].filter((name) => this.points[name]).map((name, i) => `${this.labels[i].split(" ")[0]} ${this.points[name][k].toFixed(4)}`);
    const lines = this.program ? [...this.program.told(this.said[k]), place.join(", ")] : this.told(this.said[k], place.join(", "));
    if (!this.program && !chosen.label.startsWith("feed") && chosen.values[k] !== null) lines.push(`${chosen.label} ${chosen.values[k]}`);
    $("hover").textContent = lines.join("\n");
    const [x, y] = this.at(k);
    const flip = x > this.width / 2;
    $("hover").style.left = flip ? "auto" : `${x + 14}px`;
    $("hover").style.right = flip ? `${this.width - x + 14}px` : "auto";
    $("hover").style.top = `${Math.max(y - 30, 4)}px`;
  }

  told([t, s, u, feed], place) {
    return [`t ${t.toFixed(4)} s, s ${s.toFixed(3)} mm, u ${u.toPrecision(6)}`, place, `feed ${feed.toFixed(3)} mm/s`];
  }

  listen() {
    const { canvas } = this;
    const place = (event) => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.points || event.button !== 0) return;
      const [px, py] = place(event);
      canvas.setPointerCapture(event.pointerId);
      last = { at: [px, py], from: [px, py], edits: Boolean(this.editor?.take(px, py, this.view)) };
    });
    canvas.addEventListener("pointermove", (event) => {
      const [px, py] = place(event);
      if (!last) { this.hover(px, py); return; }
      if (Math.hypot(px - last.from[0], py - last.from[1]) > 3) last.far = true;
      if (last.edits) this.editor.drag(...this.view.place(px, py));
      else if (this.view.space && !event.shiftKey) { this.view.rotate(px - last.at[0], py - last.at[1]); if (this.view.fitWhole) this.fit(); }
      else this.view.pan(px - last.at[0], py - last.at[1]);
      last.at = [px, py];
      this.draw();
    });
    const up = () => {
      if (last?.edits) this.editor.drop();
      const k = last && !last.far && this.program ? this.nearest(...last.at) : -1;
      if (k >= 0) this.program.choose(this.said[k][0]);
      last = null;
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("pointerleave", () => show($("hover"), false));
    canvas.addEventListener("wheel", (event) => {
      if (!this.points || !(event.ctrlKey || document.activeElement === canvas)) return; // else the page scrolls
      event.preventDefault();
      this.view.zoom(Math.exp(-0.0015 * event.deltaY), ...place(event));
      this.draw();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (!this.points) return;
      const steps = { ArrowLeft: [30, 0], ArrowRight: [-30, 0], ArrowUp: [0, 30], ArrowDown: [0, -30] };
      if (steps[event.key]) { if (this.view.space && !event.shiftKey) this.view.rotate(...steps[event.key].map((d) => -d / 3)); else this.view.pan(...steps[event.key]); }
      else if (event.key === "+" || event.key === "=") this.view.zoom(1.25, ...this.view.centre);
      else if (event.key === "-") this.view.zoom(0.8, ...this.view.centre);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
      this.draw();
    });
  }
}
