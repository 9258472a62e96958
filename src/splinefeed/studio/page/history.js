// Plans that were made before: pictures, numbers, and buttons to open, compare and delete them.
import { $, make } from "./dom.js";
import { digits, length } from "./numbers.js";

export class History {
  constructor(link) {
    this.link = link;
    $("show-history").addEventListener("click", () => { this.link.send({ do: "history" }); $("history").showModal(); });
  }

  ask() {
    if ($("history").open) this.link.send({ do: "history" });
  }

  show({ entries, kept }) {
    const card = (each) => {
      const n = each.numbers;
      const lines = [`${digits(n.duration_s)} s, ${digits(n.length_mm, 5)} mm`, `${n.strategy}, ${n.method}`];
      if (n.machine) lines.push(`${n.machine}${n.contour_error_max_mm == null ? "" : `, contour error ${length(n.contour_error_max_mm)}`}`);
      const open = (pin) => { this.link.send({ do: "history", open: each.id, pin }); $("history").close(); };
      return make("article", { class: "entry", data: { entry: each.id } },
        make("img", { src: `data:image/svg+xml,${encodeURIComponent(each.picture)}`, alt: "", width: 96, height: 96 }),
        make("div", {}, make("h3", {}, each.name, " ", make("span", { class: n.ok ? "good" : "bad" }, n.ok ? "holds" : "over")),
          ...lines.map((text) => make("p", {}, text)), make("p", { class: "note" }, new Date(1000 * each.made).toLocaleString()),
          make("div", { class: "row" }, make("button", { type: "button", onclick: () => open(false) }, "Open"),
            make("button", { type: "button", onclick: () => open(true) }, "Compare"),
            make("button", { type: "button", "aria-label": `delete ${each.name}`, onclick: () => this.link.send({ do: "history", delete: each.id }) }, "Delete"))));
    };
    const none = kept ? "No plans yet: every finished plan is kept here." : "This studio was started with --no-history.";
    $("entries").replaceChildren(...(entries.length ? entries.map(card) : [make("p", {}, none)]));
  }
}
