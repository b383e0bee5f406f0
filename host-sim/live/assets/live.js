// The page: events of the server in, plots, tables and track out.
import { errors, proofs, samples } from "./plots.js";
import { alignment, axes, bound, counters, faults, now, prose, trials, way, what } from "./tables.js";
import { attitude } from "./attitude.js";
import { Track } from "./track.js";
import { buttons } from "./orders.js";

const at = (id) => document.getElementById(id);
/** Pictures are drawn no more often than this, ms. */
const FRAME = 100;

const rates = samples(at("plot-rates"), 0);
const forces = samples(at("plot-forces"), 3);
const gyro = errors(at("plot-gyro"), 0);
const accel = errors(at("plot-accel"), 3);
const proven = proofs(at("plot-proof"));
const track = new Track(at("track"), at("track-scale"));
const pictures = [...rates.lanes, ...forces.lanes, gyro, accel, proven, track];
const orders = buttons();

let drawn = 0;
function draw(time) {
  if (time - drawn >= FRAME) {
    drawn = time;
    for (const picture of pictures) picture.draw();
  }
  requestAnimationFrame(draw);
}
requestAnimationFrame(draw);

let shownProblem;
/** Shows whether the device is there. */
function device(state, problem) {
  const badge = at("device");
  badge.textContent = state;
  badge.className = `badge ${state === "connected" ? "connected" : "lost"}`;
  const target = at("problem");
  target.hidden = !problem;
  if (shownProblem !== problem) prose(target, problem ?? ""); // a screen reader reads it once
  shownProblem = problem;
  document.querySelector("main").classList.toggle("stale", state !== "connected");
  orders.enable(state === "connected");
}

/** One point of what changes slowly. */
function point(p) {
  gyro.add(p.t, p.estimate, p.sigma, p.in_force);
  accel.add(p.t, p.estimate, p.sigma, p.in_force);
  if (p.proof) proven.add(p.t, p.proof);
  if (p.place) track.add(p.place, p.heading);
  else track.gap();
}

/** When samples last came, ms, and what prevents them. */
let fresh = null;
let broken = [];
setInterval(() => {
  const quiet = fresh == null ? 0 : (performance.now() - fresh) / 1000;
  for (const id of ["plot-rates", "plot-forces"]) at(id).closest("section").classList.toggle("stale", quiet > 2);
  if (quiet > 2 && !broken.length) {
    at("samples-note").textContent = `No samples for ${Math.floor(quiet)} s; these are the last ones.`;
  }
}, 1000);

const on = {
  history(points) {
    for (const picture of pictures) picture.clear();
    for (const p of points) point(p);
  },
  samples(s) {
    broken = s.broken;
    if (s.corrected) {
      fresh = performance.now();
      rates.add(s.t, s.raw, s.corrected);
      forces.add(s.t, s.raw, s.corrected);
      axes(s);
      at("samples-note").textContent =
        `${s.corrected.n} samples in the last 1/20 s; the values are their means, the bands their extremes. ` +
        `Raw values are from ${s.raw_from}.`;
    }
    if (s.broken.length) prose(at("samples-note"), s.broken.join("; "));
  },
  status(s) {
    device("connected");
    at("mode").textContent = s.mode;
    const acts = s.in_force.some((value) => value !== 0);
    at("acts").textContent = acts ? "corrections act now" : "no correction acts";
    orders.mode(s.mode);
    orders.knows(s);
    way(s.steps);
    attitude(s.solution?.attitude_deg);
    faults(s.faults);
    counters(s);
    alignment(s);
    bound(s.error_bound_m);
    trials(s);
    now(s);
    point({
      t: s.t, estimate: s.solution?.estimate, sigma: s.solution?.sigma, in_force: s.in_force,
      proof: s.trials?.each.map((each) => each.proof), place: s.solution?.place_deg,
      heading: s.solution?.attitude_deg[2],
    });
  },
  info(i) {
    at("unit").textContent = i.name ? `${i.name}${i.serial ? ` ${i.serial}` : ""}` : "IMU co-processor";
    at("activation").textContent = i.activation ?? "none";
    orders.is(i);
    what(i);
  },
  lost(l) { device("lost", l.problem); },
};

const source = new EventSource("events");
for (const [name, act] of Object.entries(on)) {
  source.addEventListener(name, (event) => act(JSON.parse(event.data)));
}
source.onerror = () => device("server gone", "The server does not answer; the page looks for it again by itself.");
