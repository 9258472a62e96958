// Long curves: of what is seen of them every point is drawn, or the area from the least to the greatest of each column of
// pixels where there are more points than that. Report and studio share this file.
import { dressed } from "./dress.js";
import { make } from "./dom.js";

const GAP = 65535, BLOCK = 256; // as detail.py has them
const SAMPLES = { dash: "╍╍ ", dot: "┉┉ ", dashdot: "━┉ ", longdash: "━╍ " }; // of dashed curves, beside their values
const APART = 8; // pixels between two points from which on each is marked
const DENSE = 3; // points in a column of pixels from which on the area is drawn

export const unpacked = async (text) => {
  const packed = atob(text);
  const bytes = new Uint8Array(packed.length);
  for (let k = 0; k < packed.length; k++) bytes[k] = packed.charCodeAt(k);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
};

const FINEST = 0.005; // of all that a curve reaches: a panel shows at least so much of it, the steps of values are finer

// curves by number, taken out of one row of bytes when they are asked for
export class Curves {
  constructor(series, buffer) {
    Object.assign(this, { series, buffer, taken: new Map() });
  }

  get(number) {
    if (!this.taken.has(number)) {
      const said = this.series[number];
      this.taken.set(number, said.unit === undefined ? this.values(said) : this.times(said));
    }
    return this.taken.get(number);
  }

  // the least and the greatest of a curve, all of it
  ends(number) {
    this.reach ??= new Map();
    if (!this.reach.has(number)) {
      let [low, high] = [Infinity, -Infinity];
      for (const value of this.get(number)) { if (value < low) low = value; if (value > high) high = value; }
      this.reach.set(number, [low, high]);
    }
    return this.reach.get(number);
  }

  times({ n, at, from, unit }) {
    const bytes = new Uint8Array(this.buffer, at, 4 * n);
    const out = new Float64Array(n);
    for (let k = 0, sum = 0; k < n; k++) {
      sum += bytes[k] + 256 * bytes[n + k] + 65536 * bytes[2 * n + k] + 16777216 * bytes[3 * n + k];
      out[k] = from + sum * unit;
    }
    return out;
  }

  values({ n, at }) {
    const blocks = Math.ceil(n / BLOCK);
    const scales = new DataView(this.buffer, at, 16 * blocks);
    const bytes = new Uint8Array(this.buffer, at + 16 * blocks, 2 * n);
    const out = new Float64Array(n);
    for (let k = 0, code = 0, low = 0, step = 0; k < n; k++) {
      if (k % BLOCK === 0) {
        low = scales.getFloat64((8 * k) / BLOCK, true);
        step = scales.getFloat64(8 * (blocks + k / BLOCK), true);
      }
      code = (code + bytes[k] + 256 * bytes[n + k]) & 65535;
      out[k] = code === GAP ? NaN : low + step * code;
    }
    return out;
  }
}

// the long curves of a figure that brings its own, unpacked once; null where it has none
export const curvesOf = (figure) => {
  if (figure.store) figure.curves ??= unpacked(figure.store.data).then((buffer) => new Curves(figure.store.series, buffer));
  return figure.curves ?? Promise.resolve(null);
};

// the first place in a rising row at which the value is not below x
export const firstNotBelow = (row, x) => {
  let [low, high] = [0, row.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (row[middle] < x) low = middle + 1; else high = middle;
  }
  return low;
};

// what is seen of a curve from x = from to x = to: points, or the area of as many columns; and how it is told
const seenOf = (detail, curves, [from, to], columns, log) => {
  const x = curves.get(detail.x);
  const stretches = detail.low !== undefined;
  const [low, high] = stretches ? [curves.get(detail.low), curves.get(detail.high)] : [curves.get(detail.y), curves.get(detail.y)];
  const first = Math.max(firstNotBelow(x, from) - 1, 0), last = Math.min(firstNotBelow(x, to) + 1, low.length);
  const dense = last - first > DENSE * columns;
  if (!stretches && !dense) {
    return { x: x.slice(first, last), y: low.slice(first, last), count: last - first, how: "points" };
  }
  const out = { x: [], low: [], high: [], count: last - first, how: dense ? "columns" : "stretches" };
  if (!dense) { // each stretch as wide as it is
    for (let k = first; k < last; k++) {
      out.x.push(x[k], x[k + 1]); out.low.push(low[k], low[k]); out.high.push(high[k], high[k]);
    }
    return out;
  }
  const at = log ? Math.log : (value) => value;
  const [start, wide] = [at(from), (at(to) - at(from)) / columns];
  let column = -Infinity;
  for (let k = first; k < last; k++) {
    const here = Math.floor((at(x[k]) - start) / wide);
    if (here !== column) {
      column = here;
      const middle = start + (here + 0.5) * wide;
      out.x.push(log ? Math.exp(middle) : middle); out.low.push(low[k]); out.high.push(high[k]);
    } else {
      const m = out.x.length - 1;
      if (low[k] < out.low[m] || Number.isNaN(out.low[m])) out.low[m] = low[k];
      if (high[k] > out.high[m] || Number.isNaN(out.high[m])) out.high[m] = high[k];
    }
  }
  return out;
};

// the outline of an area, one after the other where it is broken
const outline = ({ x, low, high }) => {
  const out = { x: [], y: [] };
  for (let k = 0; k < x.length;) {
    if (Number.isNaN(low[k])) { k += 1; continue; }
    let end = k;
    while (end < x.length && !Number.isNaN(low[end])) end += 1;
    if (out.x.length) { out.x.push(null); out.y.push(null); }
    for (let i = k; i < end; i++) { out.x.push(x[i]); out.y.push(high[i]); }
    for (let i = end - 1; i >= k; i--) { out.x.push(x[i]); out.y.push(low[i]); }
    out.x.push(x[k]); out.y.push(high[k]);
    k = end;
  }
  return out;
};

// the greatest of each strip of a heat map in even columns; one without a point has that of the one before
const strips = ({ strips: rows }, curves, [from, to], columns) => {
  const x = curves.get(rows[0].x);
  const count = Math.max(Math.min(columns, x.length - 1), 1), wide = (to - from) / count;
  const first = Math.max(firstNotBelow(x, from) - 1, 0), last = Math.min(firstNotBelow(x, to) + 1, x.length);
  const z = rows.map((row) => {
    const values = curves.get(row.high ?? row.y), out = new Float64Array(count).fill(NaN);
    for (let k = first; k < Math.min(last, values.length); k++) {
      const column = Math.min(Math.max(Math.floor((x[k] - from) / wide), 0), count - 1);
      if (!(values[k] <= out[column])) out[column] = values[k];
    }
    for (let k = 1; k < count; k++) if (Number.isNaN(out[k])) out[k] = out[k - 1];
    return out;
  });
  return { x: Array.from({ length: count + 1 }, (_, k) => from + k * wide), z };
};

// the ends of all long curves over an axis of x
const wholeOf = (figure, curves, axis) => {
  let ends = [Infinity, -Infinity];
  for (const { detail, xaxis, own } of figure.data) {
    if (!detail || own || (xaxis ?? "x") !== axis) continue;
    const x = curves.get((detail.strips?.[0] ?? detail).x);
    ends = [Math.min(ends[0], x[0]), Math.max(ends[1], x[x.length - 1])];
  }
  return ends;
};

// a figure with what is seen of its long curves; ranges: ends of x by axis where they are not those of the data
export const zoomed = (figure, curves, ranges, width) => {
  if (!figure.data.some((trace) => trace.detail)) return { figure, told: null };
  const columns = Math.max(Math.round(width - (figure.layout.margin?.l ?? 66) - (figure.layout.margin?.r ?? 24)), 100);
  const told = { count: 0, how: "points", stretch: 0 };
  const reach = {}; // by axis of y, the ends of what is seen and of all
  const widen = (ends, low, high) => [Math.min(ends?.[0] ?? Infinity, low), Math.max(ends?.[1] ?? -Infinity, high)];
  const data = figure.data.map((trace) => {
    const { detail, own, ...rest } = trace; // own: curves of another figure
    if (!detail) return trace;
    const axis = trace.xaxis ?? "x", log = figure.layout[axis.replace("x", "xaxis")]?.type === "log";
    const range = ranges[axis] ?? wholeOf(figure, own ?? curves, axis);
    if (detail.strips) return { ...rest, ...strips(detail, own ?? curves, range, columns) };
    const seen = seenOf(detail, own ?? curves, range, columns, log);
    const key = (trace.yaxis ?? "y").replace("y", "yaxis"), each = (reach[key] ??= {});
    for (const number of detail.low !== undefined ? [detail.low, detail.high] : [detail.y]) each.all = widen(each.all, ...(own ?? curves).ends(number));
    for (const row of seen.how === "points" ? [seen.y] : [seen.low, seen.high]) for (const value of row) if (value === value) each.seen = widen(each.seen, value, value);
    told.count = Math.max(told.count, seen.count);
    if (seen.how !== "points" && told.how !== "columns") told.how = seen.how;
    if (detail.low !== undefined) { const x = (own ?? curves).get(detail.x); told.stretch = (x[x.length - 1] - x[0]) / (x.length - 1); }
    if (seen.how === "points") { // few of them are marked: what is drawn between two of them is a line, not the motion
      const marked = seen.count * APART < columns && rest.mode === "lines" && !rest.fill;
      told.marked ||= marked;
      return { ...rest, x: seen.x, y: seen.y, ...(marked ? { mode: "lines+markers", marker: { size: 4, color: rest.line.color } } : {}) };
    }
    return { ...rest, ...outline(seen), fill: "toself", fillcolor: rest.line.color, line: { ...rest.line, width: 1 } };
  });
  const layout = { ...figure.layout };
  for (const [axis, range] of Object.entries(ranges)) {
    const key = axis.replace("x", "xaxis");
    layout[key] = { ...layout[key], range: layout[key].type === "log" ? range.map(Math.log10) : range, autorange: false };
  }
  for (const [key, { seen, all }] of Object.entries(reach)) { // not so close that the steps of values show
    const least = FINEST * (all[1] - all[0]), middle = seen && (seen[0] + seen[1]) / 2;
    if (seen && seen[1] - seen[0] < least && layout[key].type !== "log" && !layout[key].range) layout[key] = { ...layout[key], range: [middle - least / 2, middle + least / 2] };
  }
  const over = axesOf(figure).map((key) => figure.layout[key]);
  if (over.length && over.every(isTime)) layout.hovermode = false; // the cursor tells, from every point
  return { figure: { ...figure, data, layout }, told };
};

// what is drawn, in words
const toldWords = (told) => {
  if (!told) return "";
  const count = told.count.toLocaleString("en");
  if (told.how === "points") return told.stretch ? "" : `${count} points, every one is drawn${told.marked ? ", as a dot; lines join them" : ""}`;
  const block = `${Number((1000 * told.stretch).toPrecision(3))} ms`;
  if (told.how === "stretches") return `areas from the least to the greatest of every ${block}: this page has nothing finer`;
  return `${count} ${told.stretch ? `blocks of ${block}` : "points"}: areas from the least to the greatest in each column of pixels; zoom in for every ${told.stretch ? "block" : "point"}`;
};

// the value of a curve at x: between its points on the line, behind its ends none
const at = (x, values, wanted) => {
  const k = firstNotBelow(x, wanted);
  if (k === 0 || k >= x.length) return x[Math.min(k, x.length - 1)] === wanted ? values[Math.min(k, values.length - 1)] : undefined;
  if (values.length < x.length) return values[k - 1]; // of a stretch
  const wide = x[k] - x[k - 1];
  return wide > 0 ? values[k - 1] + ((wanted - x[k - 1]) / wide) * (values[k] - values[k - 1]) : values[k];
};

const three = (value) => (value !== 0 && Math.abs(value) < 1e-3 ? value.toExponential(2) : Math.abs(value) >= 1000 ? value.toFixed(0) : Number(value.toPrecision(3)).toString());
const NAMED = 3; // curves of a panel whose values have their names beside them
const NARROW = 640; // pixels: a telephone, where values stand in their panels, below its heading
// what tells a curve from the others of its panel
const shortName = (trace, traces) => (traces.every((each) => each.name.split(" ").at(-1) === trace.name.split(" ").at(-1)) ? trace.name.replace(/ \S+$/, "") : trace.name);

const CONFIG = { displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
const TIME = "time (s)";
const axesOf = (figure) => Object.keys(figure.layout).filter((key) => /^xaxis\d*$/.test(key));
const isTime = (axis) => axis?.title?.text === TIME;

// Figures drawn by Plotly, each with what is seen of its long curves; those over time are zoomed together.
export class Stack {
  constructor(clock) {
    this.clock = clock;
    clock.on((t) => { for (const place of this.shown.keys()) this.point(place, t); });
    this.shown = new Map();
    this.seen = null; // the ends of time that are seen, null: the whole
    // Plotly's own way to follow the window forgets how high a figure is
    this.widths = new ResizeObserver((changes) => {
      for (const { target } of changes) if (target.clientWidth && Math.abs(target.clientWidth - (target._fullLayout?.width ?? target.clientWidth)) > 1) this.paint(target);
    });
  }

  // draw a figure in a place
  async draw(place, figure, curves, { size = {} } = {}) {
    const before = this.shown.get(place);
    const each = { readouts: [], ...before, figure, curves, size, ranges: before?.ranges ?? {} };
    this.shown.set(place, each);
    await this.paint(place);
    if (!before) {
      place.on("plotly_relayout", (change) => this.relayout(place, change));
      each.told = make("p", { class: "sub told", role: "status" });
      place.after(each.told);
      this.tell(place);
      this.follow(place);
      this.widths.observe(place);
    }
  }

  // the panels over time of a figure as it is drawn
  panels(place) {
    const layout = place._fullLayout, panels = [];
    for (const key of Object.keys(layout ?? {})) {
      if (!/^yaxis\d*$/.test(key)) continue;
      const y = layout[key], x = layout[y.anchor.replace("x", "xaxis")];
      if (isTime(x)) panels.push({ y, x, traces: place._fullData.filter((trace) => (trace.yaxis ?? "y") === key.replace("axis", "")) });
    }
    return panels;
  }

  // the mouse sets the time, and while that plays a click does
  follow(place) {
    const set = (event) => {
      const box = place.getBoundingClientRect(), [px, py] = [event.clientX - box.left, event.clientY - box.top];
      for (const { x, y } of this.panels(place)) {
        if (px < x._offset || px > x._offset + x._length || py < y._offset || py > y._offset + y._length) continue;
        this.clock.to(x.p2l(px - x._offset));
        return;
      }
    };
    place.addEventListener("pointermove", (event) => { if (!this.clock.playing && !event.buttons) set(event); });
    place.addEventListener("click", set);
  }

  // the cursor at a time, and beside each panel what its curves are there
  point(place, t) {
    const each = this.shown.get(place), panels = this.panels(place);
    for (const left of [each.cursor, ...each.readouts].slice(panels.length ? 1 + panels.length : 0)) if (left) left.hidden = true; // of the figure before
    if (!panels.length) return;
    if (!each.cursor?.isConnected) {
      each.cursor = make("div", { class: "cursor" });
      place.append(each.cursor);
    }
    while (each.readouts.length < panels.length) {
      each.readouts.push(make("div", { class: "readout" }));
      place.append(each.readouts.at(-1));
    }
    const [x] = panels.map((panel) => panel.x), at = x.l2p(t);
    const seen = at >= -2 && at <= x._length + 2;
    const top = Math.min(...panels.map(({ y }) => y._offset)), end = Math.max(...panels.map(({ y }) => y._offset + y._length));
    each.cursor.hidden = !seen;
    Object.assign(each.cursor.style, { left: `${x._offset + at}px`, top: `${top}px`, height: `${end - top}px` });
    const narrow = place.clientWidth < NARROW;
    panels.forEach(({ y, traces }, k) => {
      const out = each.readouts[k];
      out.hidden = !seen;
      out.replaceChildren(...(seen ? this.values(each, traces, t, y, narrow ? 1 : NAMED) : []));
      Object.assign(out.style, { top: `${y._offset + (narrow && traces.length > 1 ? 1 : -17)}px`, right: `${Math.max(place.clientWidth - x._offset - x._length, 4)}px` });
    });
  }

  // curves at a time, each by its name where there are some
  values(each, traces, t, y, named) {
    const found = traces.filter((trace) => trace.visible !== "legendonly").map((trace) => {
      const { detail, own } = each.figure.data[trace.index] ?? {};
      const curves = own ?? each.curves;
      if (detail?.strips) {
        const shares = detail.strips.map((row) => at(curves.get(row.x), curves.get(row.high ?? row.y), t));
        const top = shares.reduce((best, value, k) => (value > shares[best] ? k : best), 0);
        return `nearest its limit: ${trace.y[top]} ${three(shares[top])} %`;
      }
      const rows = detail?.low !== undefined ? ["low", "high"] : ["y"];
      const values = detail ? rows.map((row) => at(curves.get(detail.x), curves.get(detail[row]), t)) : [at(trace.x, trace.y, t)];
      if (values.some((value) => value === undefined || Number.isNaN(value))) return null;
      const least = y.type === "log" ? 0 : 1e-5 * Math.max(...y.range.map(Math.abs)); // less is rounding
      const words = values.map((value) => three(Math.abs(value) < least ? 0 : value));
      const said = words[0] === words.at(-1) ? words[0] : words.join(" to ");
      if (traces.length === 1) return said;
      const name = `${trace.name.split(" ")[0] === "A:" ? "A: " : ""}${shortName(trace, traces)}`;
      // with many curves the heading has their names; their colours stand here
      return make("span", { title: name }, make("span", { "aria-hidden": "true", style: `color:${trace.line.color}` }, SAMPLES[trace.line.dash] ?? "\u25a0 "), traces.length > named ? "" : `${name} `, said);
    });
    return found.filter(Boolean);
  }

  ranges(figure, own) {
    const ranges = { ...own };
    for (const key of axesOf(figure)) {
      if (!isTime(figure.layout[key])) continue;
      delete ranges[key.replace("axis", "")];
      if (this.seen) ranges[key.replace("axis", "")] = this.seen;
    }
    return ranges;
  }

  async paint(place) {
    const each = this.shown.get(place);
    const { figure, told } = zoomed(each.figure, each.curves, this.ranges(each.figure, each.ranges), place.clientWidth || 700);
    each.words = toldWords(told);
    const { data, layout } = dressed(figure);
    each.painting = true;
    await Plotly.react(place, data, { ...layout, ...(place.clientWidth ? { width: place.clientWidth } : {}), ...each.size }, CONFIG);
    each.painting = false;
    if (!each.readouts.every((out) => out.isConnected)) each.readouts = [];
    this.point(place, this.clock.t);
    if (each.told) this.tell(place);
  }

  tell(place) {
    const { told, words } = this.shown.get(place);
    told.textContent = words;
    told.hidden = !words;
  }

  // the user has zoomed: what is seen now is drawn anew, of all figures over time
  relayout(place, change) {
    const each = this.shown.get(place);
    if (each.painting) return;
    let time = false, changed = false;
    for (const key of axesOf(each.figure)) {
      const from = change[`${key}.range[0]`] ?? change[`${key}.range`]?.[0], to = change[`${key}.range[1]`] ?? change[`${key}.range`]?.[1];
      const whole = change[`${key}.autorange`];
      if (from === undefined && !whole) continue;
      const log = each.figure.layout[key].type === "log";
      const range = whole ? null : log ? [10 ** from, 10 ** to] : [Number(from), Number(to)];
      changed = true;
      if (isTime(each.figure.layout[key])) { this.seen = range; time = true; }
      else if (range) each.ranges[key.replace("axis", "")] = range;
      else delete each.ranges[key.replace("axis", "")];
    }
    if (!changed) return;
    for (const [other, { figure }] of this.shown) {
      if (other === place || (time && axesOf(figure).some((key) => isTime(figure.layout[key])))) this.paint(other);
    }
  }
}
