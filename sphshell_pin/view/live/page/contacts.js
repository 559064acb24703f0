// The list of contacts.
"use strict";

import { on } from "./connection.js";
import { element, number } from "./controls.js";

let pairs = [], short = [];
on("hello", (data) => {
  pairs = data.pairs;
  short = pairs.map((name) => shorten(name, pairs));
});

// The end of a name "pair/sphere" that no other name has: "link_3.0_tip" of "fingers/hand/link_3.0_tip".
export function shorten(name, names) {
  const parts = name.split("/");
  for (let k = parts.length - 1; k > 0; k -= 1) {
    const end = parts.slice(k).join("/");
    if (!names.some((other) => other !== name && `/${other}`.endsWith(`/${end}`))) return end;
  }
  return name;
}

on("state", ({ contacts, more }) => {
  const count = contacts.length + more;
  element("count").textContent = count === 1 ? "1 contact" : `${count} contacts`;
  const body = element("contacts");
  const rows = contacts.map((one) => [
    short[one.pair], fixed(one.depth, 4), fixed(one.normal, 3), fixed(one.friction, 3),
    fixed(one.slip, 2), one.motion,
  ]);
  if (!count) rows.push(["nothing touches"]);
  if (more) rows.push([`and ${more} more`]);
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((cells, index) => {
    const row = body.rows[index] || body.insertRow();
    while (row.cells.length > cells.length) row.deleteCell(-1);
    while (row.cells.length < cells.length) row.insertCell();
    row.cells[0].colSpan = cells.length === 1 ? 6 : 1;
    row.cells[0].className = cells.length === 1 ? "none" : "";
    cells.forEach((cell, k) => {
      if (k === 5) mark(row.cells[k], cell);
      else if (row.cells[k].textContent !== cell) row.cells[k].textContent = cell;
    });
    row.cells[0].title = cells.length > 1 ? pairs[contacts[index].pair] : "";
  });
});

const fixed = (value, digits) => (value === null ? "-" : Math.abs(value) >= 1e5
  ? number(value, 3) : value.toFixed(Math.max(0, digits - (Math.abs(value) >= 1000 ? 2 : 0))));

function mark(cell, motion) {
  const word = motion ?? "";
  if (cell.textContent === word) return;
  cell.textContent = "";
  if (!word) return;
  const pill = document.createElement("em");
  pill.className = word;
  pill.textContent = word;
  cell.append(pill);
}
