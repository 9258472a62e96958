// The settings as a link or as TOML, to copy, to keep, and to open again.
import { $, make } from "./dom.js";
import { decode } from "./settings.js";

export class Share {
  constructor(link, settings) {
    Object.assign(this, { link, settings });
    $("show-share").addEventListener("click", () => {
      $("share-link").value = `${location.origin}/${settings.fragment()}`;
      link.send({ do: "share", settings: settings.value });
      $("share").showModal();
    });
    const copy = (button, field) => $(button).addEventListener("click", async () => {
      $(field).select();
      try { await navigator.clipboard.writeText($(field).value); $(button).textContent = "Copied"; } catch { $(button).textContent = "Selected: press Ctrl-C"; }
    });
    copy("copy-link", "share-link");
    copy("copy-toml", "share-toml");
    $("save-toml").addEventListener("click", () => {
      const address = URL.createObjectURL(new Blob([$("share-toml").value], { type: "application/toml" }));
      make("a", { href: address, download: "splinefeed-studio.toml" }).click();
      setTimeout(() => URL.revokeObjectURL(address), 1000);
    });
    $("open-text").addEventListener("click", () => {
      const text = $("share-open").value.trim();
      const found = decode(text);
      if (found) { location.hash = text.slice(text.indexOf("#")); } else link.send({ do: "share", text });
      $("share").close();
    });
  }

  toml(text) {
    $("share-toml").value = text;
  }
}
