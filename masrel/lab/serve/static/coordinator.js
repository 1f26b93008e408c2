// The coordinator's page: the session that runs, the study, and what is recorded.

import { h, listen, momentOf, post } from "/static/common.js";

const at = (id) => document.getElementById(id);
const phases = document.body.dataset.phases.split(",");
const state = { desk: null, overview: null, jobs: {}, log: [] };

// --- messages -------------------------------------------------------------------------

const banner = at("banner");
const lost = () => {
  banner.classList.add("lost");
  banner.textContent = "No connection to the server. This page will continue automatically.";
};
const back = () => {
  if (!banner.classList.contains("lost")) return;
  banner.classList.remove("lost");
  banner.textContent = "";
};

/** Do something once: the id makes the server do it once, however often it is sent. */
async function act(name, fields, { id = crypto.randomUUID?.() ?? String(Math.random()).slice(2) + Date.now() } = {}) {
  const { status, body } = await post(`/coordinator/${name}`, { ...fields, id }, { lost });
  back();
  return { isFine: status === 200, ...body };
}

function outcome() {
  return h("p", { className: "outcome", role: "status" });
}

function tell(place, done) {
  place.className = done.isFine ? "outcome fine" : "outcome refused";
  place.textContent = done.isFine ? done.text : done.why;
}

at("stop").addEventListener("click", async () => {
  at("stop").textContent = "Stopping …";
  await post("/coordinator/stop", {}, { every: 150, lost });
  back();
  at("stop").textContent = "Emergency stop";
});

// --- the session that runs ------------------------------------------------------------

const screenWords = {
  starting: "is starting",
  instructions: "is reading the instructions",
  ready: "is asked to begin",
  presenting: "is feeling",
  grade: "is grading",
  fault: "sees that a check stopped",
  question: "is answering a question",
  break: "is having a break",
  anew: "is asked whether to start the session again",
};

function nowWords(desk) {
  if (!desk.session) {
    if (desk.screen !== "over") return "No session is running.";
    return `No session is running. The last one: ${desk.text}.`;
  }
  const { rater, session, rehearsal } = desk.session;
  const what = desk.code ? ` ${desk.practice ? "practice " : ""}${desk.code}` : "";
  const where = desk.position ? ` (${desk.position} of ${desk.n_presentations})` : "";
  const begin = `${rehearsal ? "Rehearsal of session" : "Session"} ${session}: ${rater}`;
  return `${begin} ${screenWords[desk.screen] ?? desk.screen}${what}${where}${desk.again ? ", once more" : ""}.`;
}

const controlsSaid = outcome(); // stays when the controls are made anew

function showDesk() {
  const { desk, overview } = state;
  if (!desk || !overview) return;
  at("stop").disabled = !desk.session;
  const isRehearsal = Boolean(desk.session?.rehearsal);
  at("log-title").textContent = isRehearsal ? "Log of this rehearsal: nothing counts" : "Log of this session";
  const parts = [h("p", { className: "now" }, nowWords(desk))];
  if (isRehearsal) parts.unshift(h("p", { className: "label" }, "Rehearsal: nothing counts"));
  if (desk.screen === "fault") parts.push(h("p", {}, desk.why));
  for (const note of desk.notes) parts.push(h("p", { className: "faint" }, `Note: ${note}.`));
  at("now").replaceChildren(...parts);
  const which = JSON.stringify([desk.session, overview.sessions.map((each) => [each.rater, each.session, each.stage])]);
  if (at("controls").dataset.which === which) return;
  at("controls").dataset.which = which;
  const said = controlsSaid;
  at("controls").replaceChildren(desk.session ? leaveButton(said) : startForm(overview, said), said);
}

function leaveButton(said) {
  const button = h("button", { type: "button" }, "Pause the session at its next question");
  button.addEventListener("click", async () => {
    button.disabled = true;
    tell(said, await act("leave", {}));
  });
  return h("div", { className: "row" }, button);
}

function startForm(overview, said) {
  const open = overview.sessions.filter((each) => each.stage !== "complete");
  const select = h(
    "select",
    { id: "which", name: "which" },
    ...open.map((each) =>
      h("option", { value: JSON.stringify([each.rater, each.session]) }, `${each.rater}, ${each.session}: ${stage(each)}`),
    ),
  );
  const begun = open.find((each) => each.stage === "begun") ?? open.find((each) => each.stage === "drawn");
  if (begun) select.value = JSON.stringify([begun.rater, begun.session]);
  const rehearsal = h("input", { type: "checkbox", name: "rehearsal" });
  const button = h("button", { type: "submit", className: "main", disabled: !open.length }, "Start or resume");
  const form = h(
    "form",
    {},
    h("div", { className: "row" }, h("label", {}, "Rater and session", select), h("label", { className: "check" }, rehearsal, "only a rehearsal"), button),
  );
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    button.disabled = true;
    const [rater, session] = JSON.parse(select.value);
    tell(said, await act("start", { rater, session, rehearsal: rehearsal.checked }));
    button.disabled = false;
  });
  const isNext = overview.next?.verb === "schedule"; // and has its button there
  if (isNext || !overview.sessions.some((each) => each.stage === "not drawn")) return form;
  const draw = h("button", { type: "button" }, "Draw the missing schedules");
  draw.addEventListener("click", async () => tell(said, await act("draw", {})));
  return h("div", {}, form, h("div", { className: "row" }, draw));
}

// --- the study ------------------------------------------------------------------------

function stage(each) {
  const skipped = each.n_skipped ? `, ${each.n_skipped} skipped` : "";
  if (["not drawn", "drawn", "unreadable"].includes(each.stage)) return each.stage;
  return `${each.stage}, ${each.n_graded} of ${each.n_presentations} graded${skipped}`;
}

function table(headings, rows) {
  return h(
    "table",
    {},
    h("thead", {}, h("tr", {}, ...headings.map((text) => h("th", { scope: "col" }, text)))),
    h("tbody", {}, ...rows.map((cells) => h("tr", {}, ...cells.map((cell) => h("td", {}, cell ?? ""))))),
  );
}

const time = (utc) => (utc ? momentOf(utc) : "");

/** On which days a session may begin. */
const dueWords = ({ first, last, is_overdue: isOverdue }) =>
  [first && `from ${first}`, last && `to ${last}`, isOverdue && "(overdue)"].filter(Boolean).join(" ");

function showStudy() {
  const { overview } = state;
  const status = Object.fromEntries(overview.raters.map((each) => [each.rater, each.status]));
  const gone = (rater) => (["withdrawn", "excluded"].includes(status[rater]) ? ` (${status[rater]})` : "");
  at("sessions").replaceChildren(
    table(
      ["Session", "Rater", "Stage", "Day", "Faults", "Last event"],
      overview.sessions.map((each) => [
        each.session,
        each.rater + gone(each.rater),
        each.problem ?? stage(each),
        each.held_on ?? (gone(each.rater) ? "" : dueWords(each.due)),
        String(each.n_faults),
        time(each.last_time_utc),
      ]),
    ),
  );
  showNext();
  at("events").replaceChildren(
    overview.events.length
      ? table(
          ["When", "What", "Who", "Text"],
          [...overview.events].reverse().map((each) => [
            time(each.time_utc),
            [each.kind ?? each.event, each.rater, each.session, each.code].filter(Boolean).join(", "),
            each.who ?? "",
            each.text ?? each.why ?? "",
          ]),
        )
      : h("p", { className: "faint" }, "Nothing yet."),
  );
  showDevice(overview);
  showJobs();
  refreshForms(overview);
}

const deviceWords = {
  backend: "device",
  rate_hz: "rate, Hz",
  torque_limit_nm: "largest torque, N·m",
  torque_rate_limit_nm_s: "largest change of torque, N·m/s",
  speed_limit_deg_s: "largest speed, deg/s",
  lowest_angle_deg: "lowest angle, deg",
  highest_angle_deg: "highest angle, deg",
  missed_ticks_limit: "missed ticks of any 2000, at most",
  watchdog_ms: "watchdog, ms",
};

function showDevice({ device, n_torque_problems: n }) {
  at("simulated").hidden = device.backend !== "simulated";
  const rows = Object.entries(device).map(([key, value]) => [deviceWords[key] ?? key, String(value)]);
  const problem = n ? h("p", { className: "refused" }, `${n} models need more torque than the device may send; masrel check names them.`) : "";
  at("device").replaceChildren(table(["Setting", "Value"], rows), problem);
}

// --- what comes next ------------------------------------------------------------------

const nextSaid = outcome();

/** What to press for the next step; null where this page has no act for it. */
function nextAct({ verb, command, rater, session }, stage) {
  if (command.includes("--grades paper")) return null;
  if (["run", "serve"].includes(verb)) return [stage === "begun" ? "Resume it" : "Start it", "start", { rater, session }];
  if (verb === "schedule") return ["Draw the missing schedules", "draw", {}];
  return verb in jobWords ? [jobWords[verb], "job", { verb }] : null;
}

function showNext() {
  const { desk, overview } = state;
  if (!desk || !overview) return;
  const { next, problem } = overview;
  const isRunning = Boolean(desk.session) && ["run", "serve"].includes(next?.verb); // nothing else can be started
  const its = (each) => each.rater === next?.rater && each.session === next?.session;
  const stage = overview.sessions.find(its)?.stage;
  const which = JSON.stringify([next, problem, isRunning, stage]);
  if (at("next").dataset.which === which) return;
  at("next").dataset.which = which;
  nextSaid.textContent = "";
  if (problem || !next || isRunning) return at("next").replaceChildren(problem ?? "");
  const of = next.session ? `session ${next.session} of ${next.rater}, ` : "";
  const text = h("p", {}, `Next: ${of}${next.why}.`);
  const chosen = nextAct(next, stage);
  if (!chosen) text.append(" At a terminal: ", h("code", {}, next.command));
  const row = h("div", { className: "row" }, text, chosen ? nextButton(...chosen) : null);
  at("next").replaceChildren(row, nextSaid);
}

function nextButton(words, name, fields) {
  const button = h("button", { type: "button" }, words);
  button.addEventListener("click", async () => {
    button.disabled = true;
    tell(nextSaid, await act(name, fields));
    button.disabled = false;
  });
  return button;
}

// --- long work ------------------------------------------------------------------------

const jobWords = { ratings: "Write the ratings", report: "Build the report", verify: "Verify the record", check: "Check the study", plan: "Plan the size" };

const jobsSaid = outcome();
const jobLines = h("div", {});
const jobButtons = Object.fromEntries(
  Object.keys(jobWords).map((verb) => {
    const button = h("button", { type: "button" });
    button.addEventListener("click", async () => {
      button.disabled = true;
      tell(jobsSaid, await act("job", { verb, cancel: state.jobs[verb]?.status === "running" }));
      button.disabled = false;
    });
    return [verb, button];
  }),
);
const reportLink = h(
  "p",
  { hidden: true },
  h("a", { href: "/report/report.html", target: "_blank", rel: "noopener" }, "Open the report"),
);
// made once: a button that is pressed while lines come is the same when it is let go
at("jobs").append(h("div", { className: "row" }, ...Object.values(jobButtons)), jobsSaid, reportLink, jobLines);

function showJobs() {
  const { jobs, overview } = state;
  if (!overview) return;
  for (const [verb, button] of Object.entries(jobButtons)) {
    const words = jobs[verb]?.status === "running" ? `Cancel: ${verb}` : jobWords[verb];
    if (button.textContent !== words) button.textContent = words;
  }
  reportLink.hidden = !overview.has_report;
  const lines = Object.entries(jobs).map(([verb, job]) =>
    h(
      "div",
      { className: "job" },
      h("p", { className: "outcome", role: "status" }, `${verb}: ${job.status}`),
      h("pre", { tabIndex: 0, role: "region", "aria-label": `Output of ${verb}` }, job.lines.slice(-15).join("\n")),
    ),
  );
  jobLines.replaceChildren(...lines);
}

// --- what is recorded -----------------------------------------------------------------

const who = ["who", "Reported by", { required: true }];
const why = ["why", "Why", { required: true }];
const rater = ["rater", "Rater", { options: "raters" }];
const session = ["session", "Session", { options: "sessions" }];
const needRater = ["rater", "Rater", { options: "raters", required: true }];
const needSession = ["session", "Session", { options: "sessions", required: true }];
const on = ["on", "Date, if not today", { type: "date" }];
const code = ["code", "Code", { required: true }];

const forms = [
  ["tablet", "New address for a tablet", "Make the address", [rater]],
  [
    "note",
    "Note, deviation or adverse event",
    "Record",
    [
      ["kind", "Kind", { values: ["note", "deviation", "adverse-event"], required: true }],
      ["text", "What happened", { required: true, long: true }],
      rater,
      session,
      on,
      ["severity", "Severity (adverse event)", { values: ["mild", "moderate", "severe"] }],
      ["seriousness", "Seriousness (adverse event)", { values: ["serious", "not serious"] }],
      ["relatedness", "Caused by the study?", { values: ["unrelated", "unlikely", "possible", "probable", "definite"] }],
      ["onset", "Date of onset (adverse event)", { type: "date" }],
      ["action", "Action taken (adverse event)", {}],
      ["outcome", "Outcome (adverse event)", {}],
      who,
    ],
  ],
  ["correct", "Correct a grade", "Correct", [needRater, needSession, code, ["grade", "Correct grade", { options: "grades", required: true }], who, why]],
  [
    "answer",
    "Correct an answer",
    "Correct",
    [needRater, needSession, ["question", "Question", { options: "questions", required: true }], ["answer", "Correct answer; leave empty if there was none", {}], ["code", "Code, if the question is about a model", {}], who, why],
  ],
  ["day", "Correct the date of a session", "Correct", [needRater, needSession, ["on", "Date on which it was held", { type: "date", required: true }], who, why]],
  ["skip", "Leave a model without a grade after a fault", "Record", [needRater, needSession, code, who, why]],
  ["withdraw", "A rater has left", "Record", [needRater, on, who, why]],
  ["unblind", "Unblind a code", "Record and show the model", [code, rater, session, who, why]],
];

const lists = {
  raters: (overview) => [...new Set(overview.sessions.map((each) => each.rater))],
  sessions: (overview) => [...new Set(overview.sessions.map((each) => each.session))],
  grades: (overview) => [...overview.grades, "NA"],
  questions: (overview) => overview.questions,
};

function field(formName, [name, label, { required = false, options = null, values = null, long = false, type = "text" }]) {
  const id = `${formName}-${name}`;
  let input;
  if (options || values) {
    input = h("select", { id, name, required });
    input.dataset.options = options ?? "";
    fillSelect(input, values ?? [], required);
  } else if (long) input = h("textarea", { id, name, required, rows: 3, maxLength: 4000 });
  else input = h("input", { id, name, type, required, maxLength: 500, autocomplete: name === "who" ? "name" : "off" });
  return h("div", { className: "field" }, h("label", { htmlFor: id }, label), input);
}

function fillSelect(select, values, required) {
  const before = select.value;
  const all = required ? values : ["", ...values];
  if ([...select.options].map((option) => option.value).join("\n") === all.join("\n")) return;
  select.replaceChildren(...all.map((value) => h("option", { value }, value)));
  if (all.includes(before)) select.value = before;
}

function makeForm([name, title, button, fields]) {
  const said = outcome();
  const more = h("div", {});
  const submit = h("button", { type: "submit", className: "main" }, button);
  const form = h("form", { autocomplete: "off" }, h("div", { className: "row" }, ...fields.map((each) => field(name, each))), submit, said, more);
  let id = null; // of what is sent: the same until something is changed
  form.addEventListener("input", () => {
    id = null;
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    submit.disabled = true;
    id ??= crypto.randomUUID?.() ?? `${Math.random()}${Date.now()}`;
    const done = await act(name, Object.fromEntries(new FormData(form)), { id });
    submit.disabled = false;
    if (!done.isFine) id = null; // what was refused may be possible the next time
    tell(said, done);
    if (name === "tablet") {
      id = null;
      more.replaceChildren(
        ...(done.address
          ? [h("p", { className: "address" }, done.address), h("img", { className: "qr", src: done.picture, alt: "QR code of the address" })]
          : []),
      );
    }
  });
  return h("details", { name: "form" }, h("summary", {}, title), form);
}

at("forms").append(...forms.map(makeForm));

function refreshForms(overview) {
  for (const select of at("forms").querySelectorAll("select")) {
    const list = lists[select.dataset.options];
    if (list) fillSelect(select, list(overview), select.required);
  }
}

// --- the log of the session -----------------------------------------------------------

function showLog() {
  at("log").replaceChildren(
    state.log.length
      ? table(
          ["When", "What", "Code", "Grade", "Why"],
          [...state.log].reverse().map((each) => [time(each.time_utc), each.event, each.code ?? "", each.grade ?? "", each.fault ?? each.why ?? ""]),
        )
      : h("p", { className: "faint" }, "Nothing yet."),
  );
}

// --- the live view --------------------------------------------------------------------

const canvas = at("live");
const live = { time_s: [], angle_deg: [], torque_nm: [], phase: [] };
const WINDOW_S = 10;
let drawn = true;

function takeFrame(frame) {
  if (frame.begins) {
    for (const column of Object.values(live)) column.length = 0;
  } else {
    for (const [name, column] of Object.entries(live)) column.push(...frame[name]);
  }
  const first = live.time_s.findIndex((t) => t > (live.time_s.at(-1) ?? 0) - WINDOW_S);
  if (first > 0) for (const column of Object.values(live)) column.splice(0, first);
  if (drawn) requestAnimationFrame(draw);
  drawn = false;
}

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function draw() {
  drawn = true;
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const g = canvas.getContext("2d");
  g.scale(ratio, ratio);
  const end = Math.max(live.time_s.at(-1) ?? 0, 2);
  const start = Math.max(0, end - WINDOW_S);
  const x = (t) => 48 + ((t - start) / (end - start)) * (width - 60);
  const isSealed = Boolean(state.overview?.sealed); // then nothing says what is felt
  if (!isSealed) shadePhases(g, x, height);
  chart(g, x, { low: 0, high: 180, step: 45, top: 18, bottom: isSealed ? height - 22 : height / 2 - 12, values: live.angle_deg, label: "Angle, deg", width });
  const most = Math.max(5, ...live.torque_nm.map(Math.abs)) * 1.1;
  const step = most > 12 ? 5 : 2.5;
  if (!isSealed) chart(g, x, { low: -most * 0.25, high: most, step, top: height / 2 + 18, bottom: height - 22, values: live.torque_nm, label: "Torque, N·m", width });
  g.fillStyle = css("--faint");
  g.textAlign = "right";
  g.fillText(`${end.toFixed(1)} s`, width - 12, height - 6);
  g.textAlign = "left";
  g.fillText(`${start.toFixed(1)} s`, 48, height - 6);
  if (live.time_s.length) {
    const phase = phases[live.phase.at(-1)] ?? "";
    const felt = isSealed ? "; the study is sealed, so its torque is not shown" : `, torque ${live.torque_nm.at(-1).toFixed(1)} N·m, ${phase}`;
    at("live-text").textContent = `Angle ${live.angle_deg.at(-1).toFixed(0)} deg${felt}.`;
  }
}

function shadePhases(g, x, height) {
  // the catch and what follows it, behind the curves
  const colours = [null, css("--warn-ground"), css("--chosen")];
  for (let from = 0; from < live.phase.length; ) {
    let to = from;
    while (to < live.phase.length && live.phase[to] === live.phase[from]) to += 1;
    const colour = colours[live.phase[from]];
    if (colour) {
      const left = x(live.time_s[from]);
      const right = x(live.time_s[Math.min(to, live.phase.length - 1)]);
      g.fillStyle = colour;
      g.fillRect(left, 4, Math.max(1, right - left), height - 24);
      if (right - left > 50) {
        g.fillStyle = css("--faint");
        g.textAlign = "left";
        g.fillText(phases[live.phase[from]], left + 4, height / 2 + 1);
      }
    }
    from = to;
  }
}

function chart(g, x, { low, high, step, top, bottom, values, label, width }) {
  const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
  g.font = "12px system-ui, sans-serif";
  g.lineWidth = 1;
  g.textAlign = "right";
  for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
    g.strokeStyle = css("--line");
    g.beginPath();
    g.moveTo(48, y(value));
    g.lineTo(width - 12, y(value));
    g.stroke();
    g.fillStyle = css("--faint");
    g.fillText(String(value), 42, y(value) + 4);
  }
  g.textAlign = "left";
  g.fillStyle = css("--ink");
  g.fillText(label, 52, top - 4);
  g.strokeStyle = css("--accent");
  g.lineWidth = 2;
  g.beginPath();
  values.forEach((value, index) => {
    const point = [x(live.time_s[index]), y(Math.min(high, Math.max(low, value)))];
    if (index) g.lineTo(...point);
    else g.moveTo(...point);
  });
  g.stroke();
}

window.addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
draw();

// --- news -----------------------------------------------------------------------------

listen(
  "/coordinator/events",
  {
    desk: (desk) => {
      state.desk = desk;
      showDesk();
      showNext();
    },
    overview: (overview) => {
      state.overview = overview;
      showStudy();
      showDesk();
    },
    jobs: (jobs) => {
      state.jobs = jobs;
      showJobs();
    },
    log: (log) => {
      state.log = log;
      showLog();
    },
    live: takeFrame,
  },
  { lost, back },
);
