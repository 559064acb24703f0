async () => {
  const { notice, toast } = await import("./notices.js");
  const hidden = [...document.querySelectorAll("#legend > div[hidden]")].slice(0, 3);
  for (const one of hidden) one.hidden = false;
  notice("The run has ended.", "test");
  for (const k of [1, 2]) toast(`A message of more than a line on a narrow page, no. ${k}`);
  const those = document.querySelectorAll("#status, #legend, #notice, #toasts div");
  const boxes = [...those].map((one) => one.getBoundingClientRect().toJSON());
  for (const one of hidden) one.hidden = true;
  notice(null);
  document.getElementById("toasts").replaceChildren();
  return boxes;
}
