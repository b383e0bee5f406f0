// The buttons. What discards something asks first. Each order says in words what came of it.

import { prose } from "./tables.js";

const at = (id) => document.getElementById(id);
const meta = (name) => document.querySelector(`meta[name=${name}]`).content;

function answer(text, kind) {
  const target = at("order-answer");
  prose(target, text);
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

/** Shows what an order costs, and waits for a yes or no. */
function asks(title, lost) {
  const dialog = at("ask");
  at("h-ask").textContent = `${title[0].toUpperCase()}${title.slice(1)}?`;
  at("ask-yes").textContent = title;
  at("ask-lost").replaceChildren(...lost.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  dialog.returnValue = "no";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => resolve(dialog.returnValue === "yes"), { once: true });
  });
}

/** What the learner has won in this drive. */
function won(status) {
  if (!status?.learner.navigates) return "the alignment so far";
  const { nearest, learner } = status;
  const proof = nearest ? `, and proof ${nearest.proof} of 100 ("${nearest.name}")` : "";
  return `what it has learnt from ${learner.used_fixes} fixes since the last record${proof}`;
}

/** What storing costs. */
function stores(status) {
  const lost = ["Frames are lost for up to two seconds while the flash is written."];
  if (status?.learner.navigates) {
    lost.push("If the vehicle moves meanwhile, the learner may have to align itself again. Then at most 45 of 100 remain of a proof that is not complete. Store at a standstill.");
  }
  return lost;
}

function configures(status, info, store) {
  const memory = info?.memory.drives
    ? `If the file is of another sensor (serial number) or of other network inputs: the memory of earlier drives (${info.memory.drives}), and the networks learnt from them.`
    : null;
  const acts = status?.in_force.some((value) => value !== 0) ? "The correction that acts now fades out." : null;
  return [
    `Lost: ${won(status)}. The learner begins again.`, memory, acts,
    "The device passes samples uncorrected until it has restarted, in the mode of the file.",
    ...(store ? stores() : ["Not stored: the configuration is lost when the device is switched off."]),
  ].filter(Boolean);
}

function commits(status) {
  const stored = status.steps.find((step) => step.name === "stored")?.done;
  return [
    "The networks in use now are replaced, in the middle of the drive. A navigation computer that estimates biases is disturbed by that.",
    ...(stored ? ["The networks that wait for the next power-on are no longer its next ones; `store` keeps those in use."] : []),
  ];
}

/** Connects the buttons. */
export function buttons() {
  const section = at("orders");
  if (meta("buttons") !== "yes") {
    section.replaceChildren(section.querySelector("h2"),
      Object.assign(document.createElement("p"), { textContent: "This page only shows. Start the server with --orders to have buttons." }));
    return { mode() {}, enable() {}, knows() {}, is() {} };
  }
  const all = [...section.querySelectorAll("button")];
  const modes = all.filter((button) => button.dataset.mode);
  let [waits, connected] = [false, false];
  let [status, info] = [null, null];
  const show = () => all.forEach((button) => { button.disabled = waits || !connected; });
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
  const unless = async (title, lost, order) => {
    if (await asks(title, lost)) return order;
    return answer("Nothing was sent.", "");
  };
  modes.forEach((button) => click(button, () => ({ order: "mode", mode: button.dataset.mode })));
  click(at("align-started"), () => ({ order: "alignment", finished: false }));
  click(at("align-finished"), () => ({ order: "alignment", finished: true }));
  click(at("heading"), () => ({
    order: "heading", deg: at("heading-deg").valueAsNumber, sigma: at("heading-sigma").valueAsNumber,
  }));
  // where nothing is proved the server says so, and nothing is lost
  click(at("commit"), () => {
    const order = { order: "commit-learnt" };
    return status?.learner.winner ? unless("use what was learnt", commits(status), order) : order;
  });
  click(at("store"), () => unless("store configuration and weights", stores(status), { order: "store" }));
  click(at("configure"), async () => {
    const [file] = at("unit-file").files;
    if (!file) return answer("Choose a unit file first.", "bad");
    const order = { order: "configure", unit: await file.text(), store: at("unit-store").checked };
    if (!info?.configured) return order; // nothing is lost
    return unless(`configure with ${file.name}`, configures(status, info, order.store), order);
  });
  show();
  return {
    mode(name) { modes.forEach((button) => button.setAttribute("aria-pressed", button.dataset.mode === name)); },
    enable(is) { if (is !== connected) { connected = is; show(); } },
    knows(now) { status = now; },
    is(now) { info = now; },
  };
}
