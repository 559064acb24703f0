() => {
  const found = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const text = walk.currentNode.textContent.trim(), one = walk.currentNode.parentElement;
    if (!text || !one.checkVisibility({visibilityProperty: true})) continue;
    if (one.closest("script, style, option, select, :disabled")) continue;
    const behind = [];
    for (let node = one; node; node = node.parentElement)
      behind.push(getComputedStyle(node).backgroundColor);
    found.push([text, getComputedStyle(one).color, behind]);
  }
  for (const one of document.querySelectorAll("select, input[type=text]")) {
    if (!one.checkVisibility() || one.disabled) continue;
    const behind = [];
    for (let node = one; node; node = node.parentElement)
      behind.push(getComputedStyle(node).backgroundColor);
    found.push([one.id || one.type, getComputedStyle(one).color, behind]);
  }
  return found;
}
