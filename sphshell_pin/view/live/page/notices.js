// Messages to the user: one that stays, and those that go after some seconds.
"use strict";

import { on } from "./connection.js";
import { element } from "./controls.js";

export function notice(text, why = "") {
  const node = element("notice");
  node.hidden = text === null;
  node.dataset.why = why;
  node.classList.toggle("bad", why === "ended");
  node.querySelector("span").textContent = text ?? "";
  node.querySelector("button").hidden = why !== "ended";
}

export function toast(text) {
  const node = document.createElement("div");
  node.textContent = text;
  element("toasts").append(node);
  while (element("toasts").children.length > 3) element("toasts").firstChild.remove();
  setTimeout(() => node.remove(), 7000);
}

const unless = (why) => { if (element("notice").dataset.why === why) notice(null); };

on("error", (data) => toast(data.text));
on("lost", (text) => notice(text, "lost"));
on("joined", () => unless("lost"));
on("state", (state) => {
  if (state.ended) notice(state.ended, "ended"); else unless("ended");
});
