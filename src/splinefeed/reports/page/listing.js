// The lines of a program: those that are seen are there, one of them is chosen, by the mouse, keys, or what calls `look`.
import { make } from "./dom.js";

const ROW = 20; // pixels, as the style sheet has it
const BEYOND = 10; // rows above and below what is seen

export class Listing {
  // chosen: called with a line that the user has chosen; beside: what stands at the right of a line
  constructor(list, chosen, beside = () => "") {
    Object.assign(this, { list, chosen, beside, text: [], line: 0 });
    list.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(list);
    list.addEventListener("click", ({ target }) => { const row = target.closest("[data-line]"); if (row) this.chosen(Number(row.dataset.line)); });
    list.addEventListener("keydown", (event) => {
      const page = Math.max(Math.floor(list.clientHeight / ROW) - 1, 1);
      const to = { ArrowUp: this.line - 1, ArrowDown: this.line + 1, PageUp: this.line - page, PageDown: this.line + page, Home: 1, End: this.text.length }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      this.chosen(Math.min(Math.max(to, 1), this.text.length));
    });
  }

  set(program) {
    this.text = program.split("\n");
    if (this.text.at(-1) === "") this.text.pop();
    this.list.firstElementChild.style.height = `${ROW * this.text.length}px`;
  }

  // a line is the chosen one, and seen
  look(line) {
    const { list } = this;
    this.line = line;
    const top = ROW * (line - 1);
    if (top < list.scrollTop || top + ROW > list.scrollTop + list.clientHeight) list.scrollTop = top - 0.4 * list.clientHeight;
    this.draw();
  }

  // only the rows that are seen
  draw() {
    const { list } = this;
    const first = Math.max(Math.floor(list.scrollTop / ROW) - BEYOND, 0);
    const last = Math.min(Math.ceil((list.scrollTop + list.clientHeight) / ROW) + BEYOND, this.text.length);
    list.firstElementChild.replaceChildren(...this.text.slice(first, last).map((text, i) => this.option(first + i + 1, text.trimEnd())));
    list.setAttribute("aria-activedescendant", `line-${this.line}`);
  }

  option(line, text) {
    const row = make("div", { role: "option", id: `line-${line}`, data: { line }, "aria-selected": String(line === this.line), "aria-setsize": this.text.length, "aria-posinset": line, title: text },
      make("span", {}, String(line).padStart(String(this.text.length).length)), make("span", {}, text), make("span", {}, this.beside(line)));
    row.style.top = `${ROW * (line - 1)}px`;
    return row;
  }
}
