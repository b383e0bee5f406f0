// What is shown in words and numbers.

const at = (id) => document.getElementById(id);
/** A number with so many decimals. */
const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");

/** A whole number in groups of three. */
const grouped = (value) => String(value).replace(/\B(?=(\d{3})+$)/g, "\u00a0");

/** An element with text, and attributes. */
function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text != null) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function put(id, text) {
  const target = at(id);
  if (target.textContent !== text) target.textContent = text;
}

/** Shows a text; what stands between backticks is code. */
export function prose(target, text) {
  target.replaceChildren(...text.split("`").map((part, k) => (k % 2 ? element("code", part) : part)));
}

/** The samples of the last tick. */
export function axes(s) {
  for (let axis = 0; axis < 6; axis += 1) {
    const [raw, corrected] = [s.raw?.mean[axis], s.corrected.mean[axis]];
    put(`raw-${axis}`, fixed(raw, 5));
    put(`corrected-${axis}`, fixed(corrected, 5));
    const scale = axis < 3 ? 3600 : 1000 / 9.80665;
    put(`difference-${axis}`, fixed((raw - corrected) * scale, axis < 3 ? 2 : 3));
  }
}

/** The steps to a correction, a bar each. */
export function way(steps) {
  const target = at("way");
  if (target.children.length !== steps.length || target.querySelector(".none")) {
    target.replaceChildren(...steps.map(({ name }) => {
      const row = element("li", null, { "data-step": name });
      row.append(element("span", name, { class: "name" }), element("progress", null, { max: 1, "aria-label": name }),
        element("span", null, { class: "says" }));
      return row;
    }));
  }
  steps.forEach((step, k) => {
    const row = target.children[k];
    const [, bar, says] = row.children;
    row.classList.toggle("done", step.done);
    bar.value = step.share;
    if (says.textContent !== step.says) says.textContent = step.says;
  });
}

let shownFaults = "";
/** Each fault with its remedy. */
export function faults(list) {
  const text = JSON.stringify(list);
  if (text === shownFaults) return; // so that a screen reader does not read it again
  shownFaults = text;
  const items = list.map((fault) => {
    const item = element("li", null, { "data-fault": fault.name });
    const says = element("span");
    prose(says, `: ${fault.says}. Remedy: ${fault.remedy}.`);
    item.append(element("strong", fault.name), says);
    return item;
  });
  at("faults-section").classList.toggle("first", items.length > 0);
  at("faults").replaceChildren(...(items.length ? items : [element("li", "none", { class: "none" })]));
}

const WORDS = {
  frames: "frames", other_messages: "other messages", bad_checksums: "wrong checksums", garbage_bytes: "bytes of garbage",
  raw_bytes: "bytes passed raw", missed_frames: "missed frames", blocks_given_up: "blocks given up",
};

/** Counters and how they grow; those that are 0 are folded. */
export function counters(s) {
  const body = at("counters").tBodies[0];
  const zeros = [];
  for (const [name, count] of Object.entries(s.counters)) {
    const words = WORDS[name] ?? name.replaceAll("_", " ");
    let row = body.querySelector(`[data-counter="${name}"]`);
    if (!count) {
      row?.remove();
      zeros.push(words);
      continue;
    }
    if (!row) {
      row = element("tr", null, { "data-counter": name });
      row.append(element("th", words, { scope: "row" }), element("td"), element("td"));
      body.append(row);
    }
    row.cells[1].textContent = grouped(count);
    const rate = s.per_second?.[name];
    row.cells[2].textContent = rate == null ? "–" : fixed(rate, rate < 10 ? 1 : 0);
  }
  const folded = at("zeros");
  folded.hidden = !zeros.length;
  const [summary, list] = folded.children;
  if (list.children.length !== zeros.length || list.textContent !== zeros.join("")) {
    summary.textContent = `${zeros.length} ${zeros.length === 1 ? "counter is" : "counters are"} 0`;
    list.replaceChildren(...zeros.map((words) => element("li", words)));
  }
}

/** A list of names and values; `null` is left out. */
function list(id, pairs) {
  const parts = pairs.filter(([, value]) => value != null).flatMap(([name, value, warn]) =>
    [element("dt", name), element("dd", value, warn ? { class: "warn" } : {})]);
  at(id).replaceChildren(...parts);
}

/** The learner and how it is aligned. */
export function alignment(s) {
  const l = s.learner;
  const sigma = l.heading_sigma_deg == null ? "unknown" : `${fixed(l.heading_sigma_deg, 2)} deg (1 sigma)`;
  const attitude = s.solution?.attitude_deg.map((deg) => fixed(deg, 2));
  const arm = s.antenna?.lever_arm_m.map((m, k) => `${fixed(m, 2)} ± ${fixed(s.antenna.lever_arm_sigma_m[k], 2)}`);
  list("alignment", [
    ["aligned", l.navigates ? "yes, it navigates beside the fixes" : "not yet"],
    ["heading by", l.way],
    ["heading known to", sigma],
    ["roll, pitch, heading", attitude && `${attitude.join(", ")} deg`],
    ["residual", l.residual ? `${fixed(l.residual, 2)} (1 is as expected)` : null],
    ["refused alignments", l.refused_alignments],
    ["rests", l.rest_s ? `${l.rests}, at rest for ${l.rest_s} s` : l.rests],
    ["chosen", s.trials?.each[l.winner]?.name ?? `hypothesis ${l.winner}`],
    ["fixes", `${l.used_fixes} used, ${l.refused_fixes} refused`],
    ["promotions", `${l.promotions}, given up ${l.rollbacks}`],
    ["lever arm, m", arm?.join(", ")],
    ["fix delay, ms", s.antenna && `${fixed(s.antenna.fix_delay_ms, 0)} ± ${fixed(s.antenna.fix_delay_sigma_ms, 0)}`],
    ["time", s.times?.board_ppm == null ? null : `${s.times.sync}, board ${fixed(s.times.board_ppm, 2)} ppm fast, samples ${s.times.sample ? `every ${fixed(s.times.sample.interval_us, 2)} us` : "not timed yet"}`],
    ["processor", s.busy_percent == null ? null : `${fixed(s.busy_percent, 1)} % busy, at most ${fixed(s.busiest_percent, 1)} %`],
  ]);
}

/** The harm bound. */
export function bound(metres) {
  const cells = at("bound").querySelectorAll("td");
  metres.forEach((m, k) => { cells[k].textContent = grouped(m); });
}

/** How the candidates stand. */
export function trials(s) {
  put("says", s.says.map((text) => `${text[0].toUpperCase()}${text.slice(1)}.`).join(" "));
  const body = at("trials").tBodies[0];
  if (!s.trials) {
    body.replaceChildren();
    put("rehearsals", "this board has no learner from fixes");
    return;
  }
  s.trials.each.forEach((trial, k) => {
    let row = body.rows[k];
    if (!row) {
      row = element("tr", null, { "data-candidate": trial.key });
      const name = element("th", null, { scope: "row" });
      name.append(element("span", null, { class: "mark", "aria-hidden": "true" }), trial.name);
      row.append(name, element("td"), element("td"), element("td"), element("td"));
      body.append(row);
    }
    const state = [];
    if (!trial.enabled) state.push("does not take part");
    if (trial.proved) state.push("proved");
    if (trial.leads) state.push("most evidence");
    if (s.learner.winner === k && k > 0) state.push("chosen");
    if (trial.enabled && k > 0 && trial.check < 0.5) state.push("harm found");
    row.className = `c${k}${trial.proved ? " proved" : ""}`;
    const numbers = trial.enabled && k > 0
      ? [`${trial.proof}`, fixed(trial.check, 2), fixed(trial.evidence, 1)]
      : ["–", "–", "–"];
    numbers.forEach((text, column) => { row.cells[column + 1].textContent = text; });
    row.cells[4].textContent = state.join(", ");
  });
  const horizons = [5, 10, 30, 60, 120, 300];
  const ended = s.trials.rehearsals.map((n, k) => `${n} of ${horizons[k]} s`);
  put("rehearsals", `Rehearsals ended: ${ended.join(", ")}.`);
}

/** Estimates in numbers, and the position. */
export function now(s) {
  const text = (first, digits, unit) => ["x", "y", "z"].map((axis, k) =>
    `${axis} ${fixed(s.solution.estimate[first + k], digits)} ± ${fixed(s.solution.sigma[first + k], digits)}`).join(", ") + ` ${unit}`;
  const none = "the learner does not navigate yet";
  put("gyro-now", s.solution ? text(0, 2, "deg/h") : none);
  put("accel-now", s.solution ? text(3, 3, "mg") : none);
  if (!s.solution) return put("place", none);
  const [lat, lon] = s.solution.place_deg;
  const speed = Math.hypot(...s.solution.velocity_mps);
  return put("place", `${fixed(lat, 6)}, ${fixed(lon, 6)} deg, ${fixed(s.solution.height_m, 1)} m, ${fixed(speed, 2)} m/s`);
}

/** What the device is. */
export function what(i) {
  const rate = i.rate_hz == null ? "" : `, ${i.rate_hz} Hz`;
  const unsafe = i.security.state !== "keyed";
  const drives = i.memory.drives ? `${i.memory.drives} ${i.memory.drives === 1 ? "drive" : "drives"}, ${fixed(i.memory.hours, 1)} h` : "nothing of earlier drives";
  list("what", [
    ["port", i.port],
    ["firmware", `${i.firmware}, board ${i.board}`],
    ["sensor", i.configured ? `${i.format ?? "detected"}${rate}` : "not configured", !i.configured],
    ["configuration", i.configured ? (i.stored ? "stored" : "until it is switched off") : "none", !i.configured],
    ["mode at start", i.mode_at_start],
    ["key", unsafe ? `${i.security.state}: anybody at the line can change the device` : i.security.state, unsafe],
    ["key file", i.security.state === "keyed" && !i.has_key ? "not given (--key): orders are refused" : null, true],
    ["remembers", drives],
    ["receiver", i.receiver.protocol ?? "not heard"],
    ...i.receiver.missing.map((text) => ["receiver lacks", text, true]),
    ...(i.start?.warnings ?? []).map((text) => ["warning", text, true]),
    ["crash", i.start?.crash, true],
  ]);
}
