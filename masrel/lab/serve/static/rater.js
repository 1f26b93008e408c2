// The rater's page: one screen at a time, whatever the session asks now.

import { h, listen, post } from "/static/common.js";
import { cues, w } from "/static/rater_parts.js";
import { screens } from "/static/rater_screens.js";

const FRESH_MS = 250; // in which a second tap belongs to the screen before
const SAVING_MS = 400; // after which the page says that it is still saving
const STOP_FOR_MS = 10000; // for which an emergency stop is sent until it is there

const main = document.getElementById("screen");
const note = document.getElementById("banner");
const noConnection = document.getElementById("lost");
const place = document.getElementById("place");
const progress = document.getElementById("progress");
const stop = document.getElementById("stop");

let shown = null; // the state on the screen
let busy = false; // an answer is on its way
let breakEnds = 0;

// --- what stands above the screen -----------------------------------------------------

function say(text, isGood = false) {
  note.textContent = text;
  note.classList.toggle("good", isGood);
}

function lost() {
  if (noConnection.textContent) return;
  noConnection.textContent = w("lost");
}

function back() {
  noConnection.textContent = "";
}

/** Say why something cannot be, in the screen itself. */
function refuse(text, details = "") {
  main.querySelector(".refused")?.remove();
  const why = h("p", { className: "refused", role: "alert" }, text);
  if (details) why.append(" ", h("span", { className: "details", lang: "en" }, details));
  const last = main.querySelector("details[open] .actions") ?? main.querySelector(".actions");
  if (last) last.before(why);
  else main.append(why);
}

// --- what the rater does --------------------------------------------------------------

const act = {
  async answer(answer, saved = "") {
    const { status, body } = await send("/rater/answer", { ask: shown.ask, answer });
    if (status === 200) say(saved, true);
    if (status === 200 || body.answered) sessionStorage.clear();
    if (status === 409) say(w(body.answered ? "elsewhere" : "not_saved"));
    take(status, body);
  },

  async correct(correction) {
    const { status, body } = await send("/rater/correct", correction);
    if (status === 200) say(w("corrected", correction), true);
    take(status, body);
  },

  async done() {
    const { code, position, practice, again } = shown;
    const which = shown;
    const options = { lost, isOver: () => !isSame(which, shown) };
    const { status } = await post("/rater/done", { code, position, practice, again }, options);
    if (status) back();
  },

  miss(text, part) {
    refuse(text);
    (part.querySelector("input:checked") ?? part.querySelector("input, textarea")).focus();
  },
};

/** Send something once, however often it is tapped, until the server has it. */
async function send(path, body) {
  if (busy) return { status: 0, body: {} };
  busy = true;
  main.ariaBusy = "true";
  main.querySelector(".refused")?.remove();
  say("");
  const saving = setTimeout(() => say(w("saving")), SAVING_MS);
  const result = await post(path, body, { lost });
  clearTimeout(saving);
  say("");
  busy = false;
  main.ariaBusy = "false";
  back();
  return result;
}

function take(status, body) {
  if (body.state) show(body.state);
  if (status >= 400 && status !== 409) refuse(w("refused"), body.why);
}

// --- the emergency stop: one act, at any moment ---------------------------------------

async function pressStop() {
  const until = Date.now() + STOP_FOR_MS;
  stop.textContent = w("stopping");
  const missed = () => {
    noConnection.textContent = w("stop_not_sent");
  };
  const options = { every: 150, within: 1500, lost: missed, isOver: () => Date.now() > until };
  const { status } = await post("/rater/stop", {}, options);
  stop.textContent = w("stop");
  if (status === 200) back();
  else missed();
}

/** Whether the arm moves, or is about to. */
function armMoves() {
  return shown?.screen === "presenting" || (shown?.screen === "ready" && busy);
}

stop.addEventListener("click", pressStop);

// Where a keyboard does not make the page smaller but covers it, as on an iPad, what is
// seen of the page moves, and the emergency stop with it.
const sight = window.visualViewport;
const follow = () => document.body.style.setProperty("--pan", `${sight.offsetTop}px`);
for (const kind of ["resize", "scroll"]) sight?.addEventListener(kind, follow);

document.addEventListener(
  "keydown",
  (event) => {
    if (event.key === "Escape" && armMoves() && !event.repeat) {
      event.preventDefault();
      pressStop();
    } else if (event.key === "Enter" && event.repeat) {
      event.preventDefault(); // a key that is held down answers one screen
    }
  },
  true,
);

// --- from state to screen -------------------------------------------------------------

const WHICH = ["screen", "ask", "code", "position", "practice", "again", "last", "session", "how"];

function isSame(one, other) {
  return WHICH.every((key) => JSON.stringify(one?.[key]) === JSON.stringify(other?.[key]));
}

function show(state) {
  if (shown && state.server === shown.server && state.version < shown.version) return; // overtaken
  const before = shown;
  shown = state;
  stop.hidden = !state.session;
  if ("seconds_left" in state) breakEnds = performance.now() + 1000 * state.seconds_left;
  showPlace(state);
  keepAwake(Boolean(state.session));
  if (!before || !isSame(before, state)) showScreen(state, before !== null);
}

function showScreen(state, isChange) {
  const { title, body } = (screens[state.screen] ?? screens.waiting)(state, act);
  const heading = h("h1", { tabIndex: -1 }, title);
  main.replaceChildren(heading, ...body.filter((part) => part !== null));
  main.dataset.screen = state.screen;
  document.title = [title, place.textContent, w("title")].filter(Boolean).join(" – ");
  if (state.screen === "presenting") showStretches({ n_over: 0 });
  if (state.screen === "break") showBreak();
  keepDraft(state);
  if (!isChange) return;
  heading.focus({ preventScroll: true });
  window.scrollTo(0, 0);
  main.classList.add("fresh");
  setTimeout(() => main.classList.remove("fresh"), FRESH_MS);
}

/** What was written and not yet sent is there again after a reload. */
function keepDraft({ ask }) {
  const input = main.querySelector("textarea");
  if (!input) return;
  input.value = sessionStorage.getItem(ask) ?? "";
  input.addEventListener("input", () => sessionStorage.setItem(ask, input.value));
}

function showPlace(state) {
  const { position, n_presentations: n, number, n_questions: nQuestions } = state;
  const ofQuestions = state.screen === "question" && nQuestions > 1;
  const has = Boolean(state.session && (ofQuestions || (position && n)));
  place.textContent = "";
  if (ofQuestions) place.textContent = w("question_place", state);
  else if (has) place.textContent = w(state.practice ? "practice_place" : "place", state);
  progress.hidden = !has;
  if (!has) return;
  progress.max = ofQuestions ? nQuestions : n;
  progress.value = ofQuestions ? number - 1 : position - (state.screen === "grade" ? 0.25 : 1);
}

function showStretches({ n_over: n }) {
  const count = document.getElementById("n-stretches");
  if (!count || shown?.screen !== "presenting") return;
  const { rules } = shown;
  const text = w("n_stretches", { n });
  if (count.textContent !== text) {
    count.textContent = text;
    document.getElementById("cues")?.replaceWith(cues(rules, n));
  }
}

function showBreak() {
  const clock = document.getElementById("break-left");
  if (!clock) return;
  const left = Math.max(0, Math.ceil((breakEnds - performance.now()) / 1000));
  clock.textContent = `${Math.floor(left / 60)}:${String(left % 60).padStart(2, "0")}`;
  const over = document.getElementById("break-over");
  if (left > 0 || over.textContent) return;
  document.getElementById("break-words").hidden = true;
  clock.hidden = true;
  over.textContent = w("break_over");
  document.getElementById("break-on").textContent = w("go_on");
}

setInterval(showBreak, 250);

// A tablet that goes dark in the middle of a session has no emergency stop on it.
let awake = null;

async function keepAwake(isNeeded) {
  if (!isNeeded) {
    awake?.release?.();
    awake = null;
  } else if (!awake && !document.hidden && "wakeLock" in navigator) {
    awake = {}; // asked for
    try {
      awake = await navigator.wakeLock.request("screen");
      awake.addEventListener("release", () => {
        awake = null;
      });
    } catch {
      awake = null; // the battery is low, or the connection is not encrypted
    }
  }
}

document.addEventListener("visibilitychange", () => keepAwake(Boolean(shown?.session)));

const shut = () => show({ screen: "shut", session: null, ask: null });

listen("/rater/events", { state: show, stretches: showStretches }, { lost, back, shut });
