// Pieces that the rater's screens are made of, and their words.

import { fill, h } from "/static/common.js";

const words = JSON.parse(document.getElementById("words").textContent);
const language = document.documentElement.lang;

/** Words of the page's language. */
export function w(key, values = {}) {
  return fill(words[key] ?? key, values);
}

/** A number as people write it in the page's language. */
export function number(value) {
  return new Intl.NumberFormat(language).format(value);
}

/** How long ago: today, yesterday, 3 days ago. */
export function daysAgo(days) {
  return new Intl.RelativeTimeFormat(language, { numeric: "auto" }).format(-days, "day");
}

export function button(text, onclick, properties = {}) {
  return h("button", { type: "button", onclick, ...properties }, text);
}

/** The button that sends a form, as Enter does. */
export function submit(text) {
  return h("button", { type: "submit", className: "main" }, text);
}

export function actions(...buttons) {
  return h("div", { className: "actions" }, ...buttons);
}

export function form(onsubmit, ...children) {
  const send = (event) => {
    event.preventDefault();
    onsubmit();
  };
  return h("form", { noValidate: true, autocomplete: "off", onsubmit: send }, ...children);
}

/** Large radio buttons, one of which can be chosen. */
export function choices(legend, options, { name, short = false, value = null }) {
  const labels = options.map((option) =>
    h(
      "label",
      { className: "choice" },
      h("input", { type: "radio", name, value: option.value, checked: option.value === value }),
      h("b", {}, option.text),
      option.anchor ? h("span", {}, option.anchor) : null,
    ),
  );
  return h(
    "fieldset",
    {},
    h("legend", {}, legend),
    h("div", { className: short ? "choices short" : "choices" }, ...labels),
  );
}

/** The value that is chosen; null if none is. */
export function chosen(fieldset) {
  return fieldset.querySelector("input:checked")?.value ?? null;
}

/** A line to write on, or several. */
export function writing(id, label, { rows = 0, most = 500 } = {}) {
  const input = rows
    ? h("textarea", { id, rows, maxLength: most })
    : h("input", { type: "text", id, maxLength: most, autocomplete: "off" });
  return h("div", { className: "field" }, h("label", { htmlFor: id }, label), input);
}

/** What is written there, without spaces around it. */
export function written(field) {
  return field.querySelector("input, textarea").value.trim();
}

/** What to do with the arm; a line of its own for each cue. */
export function instruction({ stretches, done_with: doneWith }) {
  if (stretches === 1) return w("stretch_once");
  if (stretches === "free") return w(doneWith === "button" ? "stretch_free_button" : "stretch_free");
  if (Array.isArray(stretches)) return stretches.length > 1 ? w("bring_back") : "";
  return w("stretch_n", { n: stretches });
}

/** The stretches that are asked for; the one that comes now is marked. */
export function cues(rules, nOver = null) {
  if (!Array.isArray(rules.stretches)) return null;
  const items = rules.stretches.map((how, index) => {
    const speed = number(how === "slow" ? rules.slow_speed_deg_s : rules.fast_speed_deg_s);
    const item = h("li", { className: nOver !== null && index < nOver ? "past" : "" }, w(how, { speed }));
    if (index === nOver) item.setAttribute("aria-current", "step");
    return item;
  });
  return h("ol", { className: "cues", id: "cues" }, ...items);
}

const HELD_MS = 400; // after which a button that is held down goes on by itself
const EVERY_MS = 80;

/** A whole number: typed, or by a tap on less and more. */
export function wholeNumber({ text, range: [low, high] }, needed) {
  const input = h("input", { type: "number", id: "answer", min: low, max: high, step: 1 });
  if (low >= 0) input.inputMode = "numeric"; // such keys have no minus
  input.setAttribute("aria-describedby", "answer-needed");
  const said = h("span", { className: "unseen", role: "status" });
  const nearest = (value) => Math.min(high, Math.max(low, value));
  const step = (by) => {
    input.value = nearest(input.value ? Math.trunc(Number(input.value)) + by : 0);
    said.textContent = input.value;
  };
  return h(
    "div",
    { className: "field" },
    h("label", { htmlFor: "answer" }, text),
    h("p", { id: "answer-needed", className: "faint" }, needed),
    h("div", { className: "stepper" }, stepButton("−", w("less"), () => step(-1)), input, stepButton("+", w("more"), () => step(1))),
    said,
  );
}

/** A button that does something once at a tap, and again and again while it is held. */
function stepButton(sign, words, step) {
  let timer = null;
  let isHeld = false;
  const release = () => clearInterval(timer);
  // not in the order of tabs: at the number itself the arrow keys do the same
  const button = h("button", { type: "button", tabIndex: -1, "aria-label": words }, sign);
  button.addEventListener("pointerdown", () => {
    release();
    isHeld = false;
    timer = setTimeout(() => {
      isHeld = true;
      timer = setInterval(() => (button.isConnected ? step() : release()), EVERY_MS);
    }, HELD_MS);
  });
  for (const kind of ["pointerup", "pointerleave", "pointercancel"]) button.addEventListener(kind, release);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("click", ({ detail }) => {
    if (!isHeld || !detail) step(); // without detail it was no pointer
    isHeld = false;
  });
  return button;
}

/** A visual-analogue scale: nothing is marked until the rater marks it. */
export function analogue(question) {
  const [low, high] = question.range;
  const line = h("div", { className: "field analogue unset" });
  const note = h("p", { className: "faint", id: "analogue-note" }, w("analogue_unset"));
  const input = h("input", { type: "range", id: "answer", min: low, max: high, step: 1, value: (low + high) / 2 });
  const mark = () => {
    line.classList.remove("unset");
    note.textContent = w("analogue_set");
  };
  input.addEventListener("input", mark);
  input.addEventListener("pointerup", mark); // in the very middle, where nothing changes
  input.setAttribute("aria-describedby", "analogue-ends analogue-note");
  const labels = [question.low_label || number(low), question.high_label || number(high)];
  const ends = h("p", { className: "ends", id: "analogue-ends" }, ...labels.map((text) => h("span", {}, text)));
  line.append(h("label", { htmlFor: "answer" }, question.text), input, ends, note);
  return line;
}

export function isMarked(line) {
  return !line.classList.contains("unset");
}
