// The picture of the path: coloured by what is chosen, with hover, control points to drag, and the tool when it plays.
import { $, numbersOf, options, show } from "./dom.js";
import { colours, shade } from "./dress.js";
import { firstNotBelow } from "./zoom.js";
import { MARGIN, View, ticks } from "./view.js";

const SHADES = 64;
const DASH = [5, 4];
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
    this.track = null; // every tick: t, x, y, z
    new ResizeObserver(() => this.resize()).observe(this.canvas.parentElement);
    $("fit").addEventListener("click", () => { this.fit(); this.draw(); });
    $("colour").addEventListener("change", () => this.draw());
    this.listen();
  }

  // path: as interactive.py makes it; curves: of its track; program: whose lines the points are, if they are a program's
  set(path, curves = null, program = null) {
    const other = this.program !== program;
    this.program = program;
    const before = this.points;
    const taken = (columns) => columns && { x: numbersOf(columns.x), y: numbersOf(columns.y), z: columns.z ? numbersOf(columns.z) : null };
    this.points = { ...taken(path.points), overTime: !path.equal && !program };
    this.rapid = taken(path.rapid);
    this.thread = taken(path.thread);
    this.arm = path.arm ? { ...taken(path.arm), t: numbersOf(path.arm.t), points: path.arm.points } : null; // poses at times
    this.now = null;
    this.joined = path.joined;
    this.stops = path.stops;
    this.track = path.track && curves ? Object.fromEntries(Object.entries(path.track).map(([name, number]) => [name, curves.get(number)])) : null;
    this.said = path.said;
    this.names = path.names;
    this.version += 1;
    const shown = Object.values(path.colours)[0].values; // rapid moves may lead far away
    this.ends = ["x", "y", "z"].map((name) => (this.points[name] ?? [0]).reduce(([low, high], value, k) => ((program && shown[k] === null) || Number.isNaN(value) ? [low, high] : [Math.min(low, value), Math.max(high, value)]), [Infinity, -Infinity]));
    // the corners of its box; an arm, or the axis of a tool, is to be seen whole, too
    const sticks = this.arm ?? (this.thread?.x.some(Number.isNaN) ? this.thread : null);
    this.reach = this.ends.map((end, axis) => [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => end[(bits >> axis) & 1]).concat([...(sticks?.["xyz"[axis]] ?? [])].filter((value) => !Number.isNaN(value))));
    const parts = Object.keys(path.colours).length === 1; // while something moves; the others follow when it rests
    this.colours = parts ? { ...this.colours, ...path.colours } : path.colours;
    this.labels = [...path.labels, ""].slice(0, 3);
    const names = Object.keys(this.colours);
    const chosen = !other && names.includes($("colour").value) ? $("colour").value : names[0];
    if (names.join() !== [...$("colour").options].map((each) => each.value).join()) options($("colour"), names.map((name) => [name, name]), chosen);
    this.frame();
    const turned = this.view.space !== path.space || !before;
    this.view.space = path.space;
    if (turned || other || this.view.fitWhole) this.fit();
    this.draw();
  }

  // the frame is as high as the path in it is, within bounds
  frame() {
    const stage = this.canvas.parentElement;
    const [wide, high] = [this.ends[0][1] - this.ends[0][0], this.ends[1][1] - this.ends[1][0]];
    const plane = !this.view.space && !this.points.overTime && this.labels[2] === "" && wide > 0;
    const across = stage.clientWidth - MARGIN.left - MARGIN.right;
    const fits = Math.round((high / wide) * across) + MARGIN.top + MARGIN.bottom;
    stage.style.height = plane && !this.program ? `${Math.min(Math.max(fits, 240), Math.max(0.62 * window.innerHeight, 300))}px` : "";
    this.resize();
  }

  fit() {
    if (!this.points || !this.width) return;
    const more = this.editor?.curves.flatMap((curve) => curve.control_points) ?? [];
    if (this.view.space || this.program) {
      const [x, y, z] = this.reach;
      this.view.fit({ x, y, z }, this.width, this.height);
      return;
    }
    const { x, y, z, overTime } = this.points;
    const all = more.length ? { x: [...x, ...more.map((p) => p[0])], y: [...y, ...more.map((p) => p[1])], z: null, overTime } : { x, y, z, overTime };
    this.view.fit(all, this.width, this.height);
  }

  resize() {
    if (!this.canvas.parentElement.clientWidth) return;
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
    this.paintTool(theme);
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
    if (this.view.space) this.measures(theme);
    this.bar(chosen, theme);
    const first = this.said[0], last = this.said[this.said.length - 1];
    const range = this.program ? "" : `, from s = ${first[1].toFixed(2)} to ${last[1].toFixed(2)} ${this.names[1].split(/[ ()]+/)[1]}`;
    canvas.setAttribute("aria-label", `the path over ${this.labels.filter(Boolean).join(", ")}${range}, coloured by ${chosen.label} from ${chosen.low.toPrecision(3)} to ${chosen.high.toPrecision(3)}`);
    Object.assign(this.still, { width: canvas.width, height: canvas.height });
    this.still.getContext("2d").drawImage(canvas, 0, 0);
  }

  // what of the path is drawn: screen x, y, and the number of the point whose colour it has; of a path that is zoomed
  // into every tick that is seen, in order, those within a pixel of each other once
  drawnPoints() {
    const { points, track, view } = this;
    const count = points.x.length;
    if (this.program || !track || !this.joined || view.fitWhole || points.overTime) return { at: (k) => this.at(k), count, of: (k) => k };
    const times = this.said.map((each) => each[0]);
    const out = { x: [], y: [], of: [] };
    let [near, inside, last] = [0, false, null];
    for (let k = 0; k < track.t.length; k++) {
      const [x, y] = view.screen(track.x[k], track.y[k], track.z ? track.z[k] : 0);
      const here = x > -200 && y > -200 && x < this.width + 200 && y < this.height + 200;
      while (near < times.length - 1 && times[near + 1] <= track.t[k]) near += 1;
      if (here && !inside && last) { out.x.push(NaN, last[0]); out.y.push(NaN, last[1]); out.of.push(near, near); }
      if (here || inside) {
        const m = out.x.length - 1;
        if (m < 0 || !here || !(Math.abs(x - out.x[m]) + Math.abs(y - out.y[m]) < 0.7)) { out.x.push(x); out.y.push(y); out.of.push(near); }
      }
      inside = here;
      last = [x, y];
    }
    return { at: (k) => [out.x[k], out.y[k]], count: out.x.length, of: (k) => out.of[k] };
  }

  // a line through points in mm, broken where they are
  stroke({ x, y, z }, dash) {
    const { pen, view } = this;
    pen.setLineDash(dash);
    pen.beginPath();
    for (let k = 0, on = false; k < x.length; k++) {
      const [px, py] = view.screen(x[k], y[k], z ? z[k] : 0);
      if (Number.isNaN(px)) { on = false; continue; }
      if (on) pen.lineTo(px, py); else pen.moveTo(px, py);
      on = true;
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  curve(chosen, theme) {
    const { pen, points } = this;
    const drawn = this.drawnPoints();
    const { at, count } = drawn;
    const level = (k) => {
      const value = chosen.values[drawn.of(k)];
      if (value === null || Number.isNaN(at(k)[0])) return -1;
      return Math.round((SHADES - 1) * Math.min(Math.max((value - chosen.low) / (chosen.high - chosen.low || 1), 0), 1));
    };
    pen.lineJoin = "round"; pen.lineCap = "round";
    pen.lineWidth = 1.2; pen.strokeStyle = theme.faint;
    if (this.rapid) this.stroke(this.rapid, DASH);
    if (this.thread && (!this.joined || this.thread.x.some(Number.isNaN))) this.stroke(this.thread, []); // NaN: the tool axis
    if (this.arm) this.poses(theme);
    if (!this.joined) { // between the points it is not known how the path runs; the thread is
      const size = count > 2000 ? 2 : 3.2;
      for (let k = 0; k < count; k++) {
        pen.fillStyle = this.ramp[Math.max(level(k), 0)];
        const [px, py] = at(k);
        pen.fillRect(px - size / 2, py - size / 2, size, size);
      }
      this.marks(theme, points.x.length);
      return;
    }
    pen.lineWidth = 5; pen.strokeStyle = theme.faint; // an edge, where a shade is near the paper's
    pen.beginPath();
    for (let k = 0, on = false; k < count; k++) {
      const [px, py] = at(k);
      if (Number.isNaN(px)) { on = false; continue; }
      if (chosen.values[drawn.of(k)] === null || !on) pen.moveTo(px, py); else pen.lineTo(px, py);
      on = true;
    }
    pen.stroke();
    let [x, y] = count ? at(0) : [0, 0];
    let k = 1;
    while (k < count) {
      const shared = level(k);
      pen.lineWidth = shared < 0 ? 1.2 : 3.2;
      pen.strokeStyle = shared < 0 ? theme.faint : this.ramp[shared];
      pen.setLineDash(shared < 0 ? DASH : []);
      pen.beginPath();
      if (!Number.isNaN(x)) pen.moveTo(x, y);
      let on = !Number.isNaN(x);
      do {
        [x, y] = at(k);
        if (Number.isNaN(x)) on = false;
        else if (on) pen.lineTo(x, y);
        else { pen.moveTo(x, y); on = true; }
        k += 1;
      } while (k < count && level(k) === shared);
      pen.stroke();
    }
    pen.setLineDash([]);
    this.marks(theme, points.x.length);
  }

  // the arm at a share between two of its poses: lines from base to tip, and a dot at each joint
  pose(k, share, colour, width) {
    const { pen, view, arm } = this;
    const [from, to] = [k * arm.points, Math.min(k + 1, arm.t.length - 1) * arm.points];
    const at = Array.from({ length: arm.points }, (_, i) => view.screen(...["x", "y", "z"].map((name) => arm[name][from + i] + share * (arm[name][to + i] - arm[name][from + i]))));
    pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = width; pen.lineJoin = "round";
    pen.beginPath();
    at.forEach(([x, y], i) => { if (i) pen.lineTo(x, y); else pen.moveTo(x, y); });
    pen.stroke();
    for (const [x, y] of width > 1.5 ? at.slice(0, -1) : []) { pen.beginPath(); pen.arc(x, y, 0.6 + width, 0, 2 * Math.PI); pen.fill(); }
  }

  // the arm along its path: the first and the last pose stronger than those between
  poses(theme) {
    const last = this.arm.t.length - 1;
    for (const part of [1, 2, 3, 4, 5]) this.pose(Math.round((part / 6) * last), 0, theme.line, 1.2);
    this.pose(last, 0, theme.bar, 1.8);
    this.pose(0, 0, theme.faint, 2);
  }

  // exact stops, start and end
  marks(theme, count) {
    const { pen } = this;
    for (const { x, y } of this.stops ?? []) {
      pen.fillStyle = "#d55e00";
      x.forEach((each, k) => { const [px, py] = this.view.screen(each, y[k], 0); pen.beginPath(); pen.arc(px, py, 3, 0, 2 * Math.PI); pen.fill(); });
    }
    const ends = [["start", 0], ["end", count - 1]];
    const closed = Math.hypot(this.at(0)[0] - this.at(count - 1)[0], this.at(0)[1] - this.at(count - 1)[1]) < 12;
    for (const [name, at] of closed ? [["start, end", 0]] : ends) {
      const [px, py] = this.at(at);
      pen.fillStyle = theme.ink;
      pen.beginPath(); pen.arc(px, py, 4.5, 0, 2 * Math.PI); pen.fill();
      const left = px > this.width - MARGIN.right - 44;
      pen.textAlign = left ? "right" : "left";
      this.word(name, px + (left ? -8 : 8), py - 8);
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

  // where a corner of the box around a path in space is
  corner(bits) { return this.view.screen(...this.ends.map((end, axis) => end[(bits >> axis) & 1])); }

  // the edges of that box
  box(theme) {
    const { pen } = this;
    const at = (bits) => this.corner(bits);
    pen.strokeStyle = theme.line;
    pen.beginPath();
    for (const axis of [0, 1, 2]) for (let bits = 0; bits < 8; bits++) if (!(bits & (1 << axis))) { pen.moveTo(...at(bits)); pen.lineTo(...at(bits | (1 << axis))); }
    pen.stroke();
  }

  // what it measures along the edges that are in front, over the path
  measures(theme) {
    const { pen, view } = this;
    const at = (bits) => this.corner(bits);
    pen.fillStyle = theme.faint;
    pen.textBaseline = "middle";
    const middle = (bits, axis, k) => (at(bits)[k] + at(bits | (1 << axis))[k]) / 2;
    for (const axis of [0, 1, 2]) {
      const edges = [0, 1, 2, 3, 4, 5, 6, 7].filter((bits) => !(bits & (1 << axis)));
      // lowest on the screen for x and y, leftmost for z
      const front = edges.reduce((best, bits) => ((axis < 2 ? middle(bits, axis, 1) > middle(best, axis, 1) + 1e-6 : middle(bits, axis, 0) < middle(best, axis, 0) - 1e-6) ? bits : best));
      const least = 1e-6 * Math.max(...this.ends.flat().map(Math.abs)); // less is rounding, also of an arc between its samples
      const [low, high] = this.ends[axis].map((value) => String(Math.abs(value) < least ? 0 : Number(value.toPrecision(4))));
      const name = this.labels[axis].split(" ")[0] + (this.program && this.rapid ? " of feed moves" : "");
      const say = (words, px, py, left) => {
        const wide = pen.measureText(words).width; // no label leaves the picture
        this.word(words, left ? Math.max(px - 8 - wide, 4) : Math.min(px + 8, this.width - MARGIN.right - wide), py);
      };
      const [below, above] = axis < 2 ? [] : [at(front), at(front | 4)].sort((one, two) => two[1] - one[1]);
      if (axis < 2) {
        const [px, py] = [middle(front, axis, 0), middle(front, axis, 1)];
        say(`${name} ${low} to ${high}`, px, py + 12, px < view.centre[0]);
      } else if (below[1] - above[1] < 18) say(`${name} ${low} to ${high}`, above[0], above[1] - 9, true);
      else { // beside the ends of the edge, where no line of the path comes
        const up = at(front | 4)[1] < at(front)[1];
        say(`${name} ${up ? high : low}`, above[0], above[1], true);
        say(up ? low : high, below[0], below[1], true);
      }
    }
    pen.textBaseline = "alphabetic";
  }

  // a word that can be read over lines
  word(text, x, y) {
    const { pen } = this;
    pen.save();
    pen.strokeStyle = colours().paper; pen.lineWidth = 4; pen.lineJoin = "round";
    pen.strokeText(text, x, y);
    pen.restore();
    pen.fillText(text, x, y);
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
  }

  // where the tool is, and where it has been, as [x, y, z] in mm
  move(position) {
    this.trail ??= [];
    this.now = null;
    if (position) { this.tool = position; this.trail.push(position); } else { this.tool = null; this.trail = []; }
    this.draw();
  }

  // the time of the clock: where the tool is then, and what has been cut so far
  when(t) {
    const { track } = this;
    if (!track) return;
    const k = Math.min(Math.max(firstNotBelow(track.t, t), 1), track.t.length - 1);
    const wide = track.t[k] - track.t[k - 1];
    const share = wide > 0 ? Math.min(Math.max((t - track.t[k - 1]) / wide, 0), 1) : 1;
    const between = (row) => row[k - 1] + share * (row[k] - row[k - 1]);
    this.tool = [between(track.x), between(track.y), track.z ? between(track.z) : 0];
    this.trail = null;
    this.now = { t, k };
    this.draw();
  }

  // the ticks up to the tool, those within a pixel of each other once
  cut(pen, view) {
    const { track, now } = this;
    const step = Math.max(Math.floor(now.k / 20000), 1);
    let before = [Infinity, 0], dashed = false;
    const to = (at, rapid) => {
      if (rapid !== dashed) { // what was cut is a line, how it came there is dashed
        pen.stroke();
        pen.setLineDash(rapid ? DASH : []);
        pen.beginPath();
        pen.moveTo(...(before[0] === Infinity ? at : before));
        dashed = rapid;
      }
      if (before[0] === Infinity) pen.moveTo(...at); else pen.lineTo(...at);
      before = at;
    };
    for (let k = 0; k < now.k; k += view.fitWhole ? step : 1) {
      const at = view.screen(track.x[k], track.y[k], track.z ? track.z[k] : 0), rapid = Boolean(track.rapid?.[k]);
      if (rapid !== dashed || Math.abs(at[0] - before[0]) + Math.abs(at[1] - before[1]) >= 1) to(at, rapid);
    }
    to(view.screen(...this.tool), Boolean(track.rapid?.[now.k]));
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
  }

  paintTool(theme) {
    if (!this.tool) return;
    const { pen, view } = this;
    pen.strokeStyle = theme.ink; pen.lineWidth = this.trail ? 1.2 : 2;
    pen.beginPath();
    if (!this.trail) this.cut(pen, view);
    else this.trail.forEach((each, k) => { const [px, py] = view.screen(...each); if (k) pen.lineTo(px, py); else pen.moveTo(px, py); });
    pen.stroke();
    if (this.arm && this.now) { // as it stands then
      const { t } = this.arm, k = Math.min(Math.max(firstNotBelow(t, this.now.t) - 1, 0), t.length - 2);
      this.pose(k, Math.min(Math.max((this.now.t - t[k]) / (t[k + 1] - t[k]), 0), 1), theme.ink, 3);
    }
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
    const place = ["x", "y", "z"].filter((name) => this.points[name]).map((name, i) => `${this.labels[i].split(" ")[0]} ${this.points[name][k].toFixed(3)}`);
    const lines = this.program ? [...this.program.told(this.said[k]), place.join(", ")] : this.told(this.said[k], place.join(", "));
    if (!this.program && !chosen.label.startsWith("feed") && chosen.values[k] !== null) lines.push(`${chosen.label.replace(/ \(.*/, "")} ${Number(chosen.values[k].toPrecision(3))} ${/\((.*)\)/.exec(chosen.label)?.[1] ?? ""}`);
    $("hover").textContent = lines.join("\n");
    const [x, y] = this.at(k);
    const flip = x > this.width / 2;
    $("hover").style.left = flip ? "auto" : `${x + 14}px`;
    $("hover").style.right = flip ? `${this.width - x + 14}px` : "auto";
    $("hover").style.top = `${Math.max(y - 30, 4)}px`;
  }

  // each value with its name and unit
  told(values, place) {
    const words = this.names.map((name, k) => { // a number of a line is whole
      if (name === "line") return `line ${values[k]}`;
      const [, word, unit] = /^(\S+)(?: \((.*)\))?$/.exec(name);
      const digits = /^(s|mm|deg|rad)$/.test(unit ?? "") ? values[k].toFixed(3) : Number(values[k].toPrecision(unit ? 3 : 6));
      return `${word} ${digits}${unit ? ` ${unit}` : ""}`;
    });
    const unit = /\((.*)\)/.exec(this.labels[this.labels.filter(Boolean).length - 1])?.[1];
    return [words.slice(0, 3).join(", "), unit ? `${place} ${unit}` : place, ...words.slice(3)];
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
