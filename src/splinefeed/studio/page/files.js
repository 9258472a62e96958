// Files that are dropped or chosen: paths go to the server, TOML is a machine or settings.
import { $ } from "./dom.js";

const LARGEST = 64 * 2 ** 20;

const upload = async (file, { refused }, taken) => {
  if (file.size > LARGEST) { refused(`${file.name} has ${Math.round(file.size / 2 ** 20)} MB; at most 64 MB are taken: use the command line`); return; }
  try {
    const answer = await fetch("/upload", { method: "POST", headers: { "X-Name": encodeURIComponent(file.name), "Content-Type": "application/octet-stream" }, body: file });
    const said = await answer.json();
    if (said.error) refused(said.error);
    else taken({ file: said.file, name: file.name });
  } catch {
    refused(`${file.name} did not get through; is splinefeed studio running?`);
  }
};

export const takeFiles = (takers) => {
  const take = async (file) => {
    if (!file) return;
    if (/\.toml$/i.test(file.name) && file.size < 2 ** 22) {
      const text = await file.text();
      if (/^\s*\[+(axis|control)\b/m.test(text)) takers.machine(file.name.replace(/\.toml$/i, ""), text);
      else if (/^\s*\[tools\./m.test(text)) await upload(file, takers, takers.tools);
      else takers.settings(text);
    } else await upload(file, takers, /\.tbl$/i.test(file.name) ? takers.tools : /\.urdf$/i.test(file.name) ? takers.robot : takers.dropped);
  };
  $("file").addEventListener("change", () => { take($("file").files[0]); $("file").value = ""; });
  const over = (on) => document.body.classList.toggle("dropping", on);
  window.addEventListener("dragover", (event) => { event.preventDefault(); over(true); });
  window.addEventListener("dragleave", (event) => { if (!event.relatedTarget) over(false); });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    take(event.dataTransfer.files[0]);
  });
};
