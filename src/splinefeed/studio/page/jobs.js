// Jobs that wait or run, each with a button that cancels it; and files to download, which are made by jobs.
import { $, make, show } from "./dom.js";

const OPEN = ["waiting", "running"];
const PATIENCE = 400; // ms that a job runs before it is shown: most end sooner

export class Jobs {
  constructor(link) {
    this.link = link;
    this.known = new Map();
    link.on("job", ({ job }) => this.change(job));
  }

  all(jobs) {
    this.known = new Map(jobs.map((job) => [job.id, job]));
    this.draw();
  }

  change(job) {
    if (OPEN.includes(job.state)) this.known.set(job.id, job); else this.known.delete(job.id);
    this.timer ??= setTimeout(() => { this.timer = null; this.draw(); }, PATIENCE);
    if (!this.known.size || $("jobs").children.length) this.draw();
  }

  // rows stay what they are while their words change, so that a button can be aimed at and keeps the focus
  draw() {
    const place = $("jobs");
    for (const row of [...place.children]) if (!this.known.has(Number(row.dataset.job))) row.remove();
    for (const job of this.known.values()) {
      const row = [...place.children].find((each) => Number(each.dataset.job) === job.id) ?? place.appendChild(this.row(job));
      const [done, total] = job.share;
      const words = row.querySelector(".words");
      row.className = `job ${job.state}`;
      words.textContent = `${job.title}: ${job.state === "waiting" ? "waiting" : job.words || "begins"}`;
      if (!total) continue;
      const bar = row.querySelector("progress") ?? make("progress", {});
      if (!bar.parentElement) words.after(bar);
      bar.max = total; bar.value = done; bar.setAttribute("aria-label", `${done} of ${total}`);
    }
  }

  row(job) {
    return make("div", { data: { job: job.id } },
      make("span", { class: "spinner", "aria-hidden": "true" }),
      make("span", { class: "words" }),
      job.kind === "warm" ? null : make("button", { type: "button", onclick: () => this.link.send({ do: "cancel", job: job.id }) }, "Cancel"));
  }
}

const TITLES = { hdf5: "HDF5", csv: "CSV", mat: "MATLAB", npz: "NumPy", parquet: "Parquet", halstreamer: "LinuxCNC halstreamer", pvt: "PVT table", json: "JSON", dxf: "DXF", svg: "SVG", ngc: "G-code" };

export class Downloads {
  constructor(link, settings) {
    Object.assign(this, { link, settings });
    $("save").addEventListener("click", () => this.open($("save-menu").hidden));
    document.addEventListener("click", (event) => { if (!event.target.closest(".menu")) this.open(false); });
    document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !$("save-menu").hidden) { this.open(false); $("save").focus(); } });
  }

  open(visible) {
    show($("save-menu"), visible);
    $("save").setAttribute("aria-expanded", String(visible));
    if (visible) $("save-menu").querySelector("button")?.focus();
  }

  build(offer) {
    const item = (what, form, text) => make("button", { type: "button", role: "menuitem", data: { what, form: form ?? "" }, onclick: () => this.make(what, form, text) }, text);
    const head = (text) => make("span", { class: "menu-head", role: "presentation" }, text);
    $("save-menu").replaceChildren(
      item("report", null, "Report, HTML"), item("numbers", null, "Numbers, JSON"),
      head("Setpoints"), ...offer.setpoints.map((form) => item("setpoints", form, TITLES[form] ?? form)),
      head("Path"), ...offer.paths.map((form) => item("path", form, TITLES[form] ?? form)),
      head("More"), item("law", null, "Time law, HDF5"), item("response", null, "Axes' response, HDF5"), item("machine", null, "Machine, TOML"));
  }

  offer(result) {
    $("save").disabled = false;
    const machine = Boolean(this.settings.value.machine);
    for (const what of ["response", "machine"]) $("save-menu").querySelector(`[data-what="${what}"]`).disabled = !machine;
  }

  make(what, form, title) {
    this.open(false);
    this.link.send({ do: "job", kind: "make", title, settings: this.settings.value, what, form });
  }

  fetch({ download, name }) {
    make("a", { href: `/download/${download}`, download: name }).click();
  }
}
