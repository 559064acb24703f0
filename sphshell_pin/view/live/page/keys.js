// The keys of the page: what each does, and the overlay that lists them.
"use strict";

import { element } from "./controls.js";

const NAMES = {
  " ": "space", ArrowLeft: "left arrow", ArrowRight: "right arrow", ArrowUp: "up arrow",
  ArrowDown: "down arrow",
};
const keys = []; // in the order in which the overlay lists them

// { keys: of KeyboardEvent.key, says: what they do, act: with the event, repeats: while held down }
export function add_key(entry) {
  keys.push(entry);
  const row = element("keys").insertRow();
  const cell = row.insertCell();
  entry.keys.forEach((key, index) => {
    if (index) cell.append(" or ");
    const cap = document.createElement("kbd");
    cap.textContent = NAMES[key] ?? key;
    cell.append(cap);
  });
  row.insertCell().textContent = entry.says;
}

function belongs_to_control(event) {
  const { target, key } = event;
  if (target.type === "text" || target.tagName === "SELECT") return true;
  if (target.type === "range") return key === "ArrowRight";
  // A button that was reached with the keyboard is pressed by it.
  return key === " " && target.closest("button, summary, input[type=checkbox]") !== null;
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || element("help").open) return;
  if (belongs_to_control(event)) return;
  const entry = keys.find((one) => one.keys.includes(event.key));
  if (!entry || (event.repeat && !entry.repeats)) return;
  event.preventDefault();
  entry.act(event);
});

// After a click, keys belong to the page again: else the space bar would press the button again.
document.addEventListener("click", (event) => {
  if (event.detail && event.target instanceof Element && !element("help").open) {
    event.target.closest("button, summary, input[type=checkbox]")?.blur();
  }
});

const open_help = () => element("help").showModal(); // Escape closes it
element("help-button").onclick = open_help;
element("help-close").onclick = () => element("help").close();
element("help").onclick = (event) => { // beside it
  if (event.target === element("help")) element("help").close();
};
export const add_help_key = () => add_key({ keys: ["?"], says: "list the keys", act: open_help });
