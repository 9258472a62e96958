// Control points and weights, moved on the picture or in a table; each change is a new curve to plan.
import { $, make, options, show, table } from "./dom.js";

const GRAB = 12; // pixels
const ROWS = 400; // of the table

export class Editor {
  constructor(settings, picture) {
    Object.assign(this, { settings, picture, document: null, selected: null, dragging: false, before: [] });
    $("edit").addEventListener("click", () => this.toggle());
  }

  get open() { return this.picture.editor === this; }

  // the curves of a result, as the text of a JSON file; null where they cannot be edited here
  set(text) {
    $("edit").disabled = !text;
    if (!text) { if (this.open) this.toggle(); this.document = null; return; }
    if (this.dragging || text === this.text) return;
    this.text = text;
    this.document = JSON.parse(text);
    this.curves = this.document.curves ?? [this.document];
    if (this.selected && !this.curves[this.selected.curve]?.control_points[this.selected.point]) this.selected = null;
    if (this.open) this.table();
  }

  toggle() {
    this.picture.editor = this.open ? null : this;
    $("edit").setAttribute("aria-pressed", String(this.open));
    $("edit").textContent = this.open ? "Done" : "Edit points";
    show($("editor"), this.open);
    if (this.open) this.table();
    if (this.picture.view.fitWhole) this.picture.fit();
    this.picture.draw();
  }

  paint(pen, view, theme) {
    pen.lineWidth = 1; pen.strokeStyle = theme.faint; pen.setLineDash([4, 3]);
    this.curves.forEach((curve) => {
      pen.beginPath();
      curve.control_points.forEach(([x, y], k) => { const at = view.screen(x, y, 0); if (k) pen.lineTo(...at); else pen.moveTo(...at); });
      pen.stroke();
    });
    pen.setLineDash([]);
    this.curves.forEach((curve, c) => curve.control_points.forEach(([x, y], k) => {
      const [px, py] = view.screen(x, y, 0);
      const chosen = this.selected?.curve === c && this.selected?.point === k;
      const size = chosen ? 6 : 4;
      pen.fillStyle = chosen ? "#d55e00" : theme.paper; pen.strokeStyle = chosen ? theme.ink : theme.bar; pen.lineWidth = 1.6;
      pen.beginPath(); pen.rect(px - size, py - size, 2 * size, 2 * size); pen.fill(); pen.stroke();
    }));
  }

  // whether there is a point to take hold of at a pixel
  take(px, py, view) {
    let [found, away] = [null, GRAB * GRAB];
    this.curves.forEach((curve, c) => curve.control_points.forEach(([x, y], k) => {
      const [qx, qy] = view.screen(x, y, 0);
      const d = (qx - px) ** 2 + (qy - py) ** 2;
      if (d <= away) { away = d; found = { curve: c, point: k }; }
    }));
    if (!found) return false;
    this.select(found);
    this.dragging = true;
    this.remember();
    this.moved = this.together(found);
    return true;
  }

  select(found) {
    const other = this.shown !== found.curve;
    this.selected = found;
    if (other) this.table();
    for (const row of $("editor").querySelectorAll("tr[data-point]")) row.classList.toggle("chosen", Number(row.dataset.point) === found.point);
    this.picture.draw();
  }

  // ends of curves that lie on a point move with it, so that the path stays whole
  together({ curve, point }) {
    const [x, y] = this.curves[curve].control_points[point];
    const isEnd = (c, k) => k === 0 || k === this.curves[c].control_points.length - 1;
    if (!isEnd(curve, point)) return [{ curve, point }];
    return this.curves.flatMap((each, c) => each.control_points.map((p, k) => ({ curve: c, point: k, p })))
      .filter((each) => isEnd(each.curve, each.point) && Math.hypot(each.p[0] - x, each.p[1] - y) < 1e-6);
  }

  drag(x, y) {
    for (const each of this.moved) this.curves[each.curve].control_points[each.point] = [x, y];
    this.show();
    this.send(true);
  }

  drop() {
    this.dragging = false;
    $("editor").querySelector("tr.chosen")?.scrollIntoView({ block: "nearest" }); // not before: the page would move under the hand
    this.send(false);
  }

  remember() {
    this.before.push(structuredClone(this.settings.value.source));
    const undo = $("undo");
    if (undo) undo.disabled = false;
  }

  undo() {
    const source = this.before.pop();
    if (!source) return;
    this.text = null;
    this.settings.value.source = source;
    this.settings.touched(false);
  }

  send(moving) {
    this.text = `${JSON.stringify(this.document)}\n`;
    this.settings.value.source = { curves: this.text };
    this.settings.touched(moving);
  }

  change(point, index, text) {
    const value = Number(text);
    if (text.trim() === "" || !Number.isFinite(value)) return;
    const curve = this.curves[this.shown];
    this.remember();
    if (index === 2) {
      curve.weights ??= curve.control_points.map(() => 1);
      curve.weights[point] = value;
    } else {
      for (const each of this.together({ curve: this.shown, point })) this.curves[each.curve].control_points[each.point][index] = value;
    }
    this.selected = { curve: this.shown, point };
    this.send(false);
    this.picture.draw();
  }

  get shown() { return Math.min(this.selected?.curve ?? 0, this.curves.length - 1); }

  show() {
    const { curve, point } = this.selected;
    const row = $("editor").querySelector(`tr[data-point="${point}"]`);
    row?.querySelectorAll("input").forEach((input, k) => { if (k < 2) input.value = String(Number(this.curves[curve].control_points[point][k].toPrecision(9))); });
  }

  table() {
    const curve = this.curves[this.shown];
    const names = ["x, mm", "y, mm", "weight"];
    const rows = curve.control_points.slice(0, ROWS).map((place, k) => {
      const values = [...place, curve.weights?.[k] ?? 1];
      const cells = values.map((value, i) => make("td", {}, make("input", { type: "number", step: "any", value: String(value), "aria-label": `point ${k + 1}, ${names[i]}`,
        onchange: (event) => this.change(k, i, event.target.value), onfocus: () => this.select({ curve: this.shown, point: k }) })));
      return make("tr", { data: { point: k } }, make("th", { scope: "row" }, String(k + 1)), ...cells);
    });
    const which = make("select", { "aria-label": "curve", onchange: (event) => { this.selected = { curve: Number(event.target.value), point: 0 }; this.table(); this.picture.draw(); } });
    options(which, this.curves.map((each, k) => [String(k), `curve ${k + 1}, degree ${each.degree}`]), String(this.shown));
    $("editor").replaceChildren(
      make("div", { class: "row editor-head" }, which, make("button", { id: "undo", type: "button", disabled: !this.before.length, onclick: () => this.undo() }, "Undo"),
        make("span", { class: "note" }, "Drag a square on the picture, or write numbers; ends that meet move together.")),
      table(["point", ...names], rows));
  }
}
