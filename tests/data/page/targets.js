() => [...document.querySelectorAll(
    "button, select, input:not([type=checkbox]), summary, label:has(input[type=checkbox])")]
  .filter((one) => one.checkVisibility({visibilityProperty: true}) && !one.closest("dialog"))
  .map((one) => {
    const box = one.getBoundingClientRect();
    return {name: one.id || one.textContent.trim(), left: box.left, right: box.right,
            top: box.top + scrollY, bottom: box.bottom + scrollY,
            floats: one.closest("#stage") !== null};
  })
