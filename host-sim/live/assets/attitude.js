// The orientation as a horizon and a compass.

const at = (id) => document.getElementById(id);
/** Height of a degree of pitch. */
const DEGREE = 2;

/** Roll, pitch and heading, deg; `undefined` before the learner navigates. */
export function attitude(deg) {
  at("attitude").classList.toggle("unknown", !deg);
  const words = at("attitude-now");
  if (!deg) {
    words.textContent = "not known before it is aligned";
    return;
  }
  const [roll, pitch, heading] = deg;
  // nose up: the horizon sinks; right wing down: it turns to the left
  at("horizon").setAttribute("transform", `rotate(${-roll} 80 80) translate(0 ${pitch * DEGREE})`);
  at("needle").setAttribute("transform", `rotate(${heading} 225 80)`);
  const fixed = (value) => value.toFixed(1);
  words.textContent = `roll ${fixed(roll)}, pitch ${fixed(pitch)}, heading ${fixed(heading)} deg`;
}
