// The buttons. Each order says in words what came of it.

const at = (id) => document.getElementById(id);
const meta = (name) => document.querySelector(`meta[name=${name}]`).content;

function answer(text, kind) {
  const target = at("order-answer");
  target.textContent = text;
  target.className = `answer ${kind}`;
}

/** Sends an order. */
async function send(order) {
  answer("asked; waiting for the device", "");
  try {
    const response = await fetch("order", {
      method: "POST",
      headers: { "content-type": "application/json", "x-live-token": meta("token") },
      body: JSON.stringify(order),
    });
    const { done, says } = await response.json();
    answer(done ? `Done: ${says}.` : `Refused: ${says}`, done ? "good" : "bad");
  } catch (error) {
    answer(`The server does not answer (${error.message}).`, "bad");
  }
}

/** Connects the buttons. */
export function buttons() {
  const section = at("orders");
  if (meta("buttons") !== "yes") {
    section.replaceChildren(section.querySelector("h2"),
      Object.assign(document.createElement("p"), { textContent: "This page only shows. Start the server with --orders to have buttons." }));
    return { mode() {}, enable() {} };
  }
  const all = [...section.querySelectorAll("button")];
  const modes = all.filter((button) => button.dataset.mode);
  let waits = false;
  let found = false;
  const show = () => all.forEach((button) => { button.disabled = waits || !found; });
  const click = (button, order) => button.addEventListener("click", async () => {
    const what = await order();
    if (!what) return;
    waits = true;
    show();
    await send(what);
    waits = false;
    show();
    button.focus();
  });
  modes.forEach((button) => click(button, () => ({ order: "mode", mode: button.dataset.mode })));
  click(at("align-started"), () => ({ order: "alignment", finished: false }));
  click(at("align-finished"), () => ({ order: "alignment", finished: true }));
  click(at("heading"), () => ({
    order: "heading", deg: at("heading-deg").valueAsNumber, sigma: at("heading-sigma").valueAsNumber,
  }));
  click(at("commit"), () => ({ order: "commit-learnt" }));
  click(at("store"), () => ({ order: "store" }));
  click(at("configure"), async () => {
    const [file] = at("unit-file").files;
    if (!file) return answer("Choose a unit file first.", "bad");
    return { order: "configure", unit: await file.text(), store: at("unit-store").checked };
  });
  show();
  return {
    mode(name) { modes.forEach((button) => button.setAttribute("aria-pressed", button.dataset.mode === name)); },
    enable(is) { if (is !== found) { found = is; show(); } },
  };
}
