// The rater's screens: each is made of a state, and of what the rater can do there.
//
// A screen is {title, body}; `act` has answer(answer, saved), done(), correct(body) and
// miss(text, part), which says what is missing and goes there.

import { h } from "/static/common.js";
import {
  actions,
  analogue,
  button,
  choices,
  chosen,
  cues,
  daysAgo,
  form,
  instruction,
  isMarked,
  number,
  submit,
  w,
  wholeNumber,
  writing,
  written,
} from "/static/rater_parts.js";

const MOST_AT_A_GLANCE = 21; // numbers that are offered one by one
const REMARKS = { "time-limit": "time_limit", "max-duration": "max_duration", "too-slow": "too_slow", "grip-lost": "grip_lost" };

function paragraph(text, properties = {}) {
  return h("p", properties, text);
}

function plain(title, text) {
  return { title, body: [paragraph(text)] };
}

/** What a presentation is that is none of the study's. */
function labels({ session, practice }) {
  return [
    session?.rehearsal ? paragraph(w("rehearsal"), { className: "label" }) : null,
    practice ? paragraph(w("practice"), { className: "label" }) : null,
  ];
}

export const screens = {
  waiting: () => plain(w("waiting_title"), w("waiting")),
  starting: () => plain(w("waiting_title"), w("starting")),
  other: () => plain(w("other_title"), w("other")),
  shut: () => plain(w("shut_title"), w("shut")),
  over: ({ how }) => ({
    title: w(`over_${how}_title`),
    body: [paragraph(w(`over_${how}`)), how === "complete" ? paragraph(w("over_wrong")) : null],
  }),

  instructions: ({ text }, act) => ({
    title: w("instructions_title"),
    body: [
      h("div", { className: "text" }, text),
      actions(button(w("go_on"), () => act.answer({ go_on: true }), { className: "main" })),
    ],
  }),

  break: (_, act) => ({
    title: w("break_title"),
    body: [
      paragraph(w("break_left"), { id: "break-words" }),
      paragraph("", { id: "break-left", className: "timer", role: "timer" }),
      paragraph("", { id: "break-over", role: "status" }),
      actions(button(w("break_early"), () => act.answer({ go_on: true }), { id: "break-on", className: "main" })),
    ],
  }),

  anew: (state, act) => ({
    title: w("anew_title"),
    body: [
      paragraph(w("anew", { ...state, when: daysAgo(state.days) })),
      actions(
        button(w("anew_go_on"), () => act.answer({ anew: false }), { className: "main" }),
        button(w("anew_begin"), () => act.answer({ anew: true })),
      ),
    ],
  }),

  ready: (state, act) => ({
    title: w(state.again ? "ready_again" : "ready_title", state),
    body: [
      ...labels(state),
      paragraph(instruction(state.rules), { className: "instruction" }),
      cues(state.rules),
      paragraph(w("stop_key"), { className: "faint keys" }),
      actions(button(w("begin"), () => act.answer({ begin: true }), { className: "main" })),
      state.last ? correction(state, act) : null,
    ],
  }),

  presenting: (state, act) => ({
    title: w("presenting_title", state),
    body: [
      ...labels(state),
      paragraph([h("span", { className: "moving", ariaHidden: "true" }), w("presenting")], { className: "now" }),
      paragraph(instruction(state.rules), { className: "instruction" }),
      cues(state.rules, 0),
      state.rules.stretches === 1 ? null : paragraph("", { id: "n-stretches", role: "status" }),
      state.may_say_done ? actions(button(w("done"), act.done, { className: "main" })) : null,
    ],
  }),

  grade: (state, act) => {
    const { anchors } = state; // the study's own words for grades, where it has any
    const options = state.grades.map((grade) => ({ value: grade, text: grade, anchor: anchors[grade] }));
    const short = !Object.keys(anchors).length;
    const grades = choices(w("scale", state), options, { name: "grade", short });
    const stretches = state.n_stretches > 1 ? stretchChoices(state.n_stretches) : null;
    const save = () => {
      const grade = chosen(grades);
      if (grade === null) return act.miss(w("choose_grade"), grades);
      const stretch = stretches ? Number(chosen(stretches)) || null : null;
      return act.answer({ grade, stretch }, w("saved", { grade }));
    };
    return {
      title: w("grade_title", state),
      body: [
        ...labels(state),
        ...state.remarks.map((each) =>
          paragraph(w(REMARKS[each], { seconds: number(state.rules.time_limit_s) }), { className: "remark" }),
        ),
        form(
          save,
          grades,
          stretches,
          actions(submit(w("save")), button(w("again"), () => act.answer({ again: true }))),
        ),
        state.source ? credit(state, short) : null,
      ],
    };
  },

  fault: (state, act) => {
    const isStop = state.why.startsWith("emergency stop");
    return {
      title: w("fault_title"),
      body: [
        paragraph(w(isStop ? "fault_stop" : "fault")),
        actions(
          button(w("present_again"), () => act.answer({ again: true }), { className: "main" }),
          button(w("end_session"), () => act.answer({ again: false })),
        ),
        state.may_skip ? skipping(act) : null,
        h("details", {}, h("summary", {}, w("fault_details")), paragraph(state.why, { lang: "en" })),
      ],
    };
  },

  question: (state, act) => {
    const field = fields[fieldOf(state)](state);
    const save = () => {
      const answer = field.answer();
      if (answer === null) return act.miss(field.missing, field.part);
      return act.answer({ answer }, w("saved_answer"));
    };
    const none = () => act.answer({ answer: null }, w("saved_none"));
    return {
      title: state.questionnaire,
      body: [
        state.code ? paragraph(w("question_of", state)) : null,
        form(
          save,
          field.part,
          actions(submit(w("save")), state.required ? null : button(w("no_answer"), none)),
        ),
      ],
    };
  },
};

/** Where the wording of a scale is, and whose the words are that stand here. */
function credit({ source }, short) {
  const words = [w(short ? "credit" : "credit_anchors"), " ", h("span", { lang: "en" }, source)];
  return paragraph(words, { className: "faint credit" });
}

function stretchChoices(n) {
  const options = [{ value: "", text: w("rests_on_none") }];
  for (let each = 1; each <= n; each += 1) options.push({ value: String(each), text: String(each) });
  return choices(w("rests_on"), options, { name: "stretch", short: true, value: "" });
}

function skipping(act) {
  const why = writing("why", w("skip_why"));
  const skip = () => (written(why) ? act.answer({ skip: written(why) }) : act.miss(w("write_why"), why));
  const send = actions(h("button", { type: "submit" }, w("skip")));
  return h("details", {}, h("summary", {}, w("skip")), form(skip, why, send));
}

function correction({ last, grades }, act) {
  const options = grades.map((grade) => ({ value: grade, text: grade }));
  const right = choices(w("correct_grade"), options, { name: "correction", short: true });
  const why = writing("correct-why", w("correct_why"));
  const save = () => {
    const grade = chosen(right);
    if (grade === null) return act.miss(w("choose_grade"), right);
    if (!written(why)) return act.miss(w("write_why"), why);
    return act.correct({ code: last.code, grade, why: written(why) });
  };
  const summary = w("correct_summary", { code: last.code, grade: last.grade ?? w("correct_missing") });
  const send = actions(h("button", { type: "submit" }, w("correct_save")));
  return h("details", {}, h("summary", {}, summary), form(save, right, why, send));
}

// --- what answers a question ----------------------------------------------------------

function fieldOf({ type, range }) {
  if (type !== "whole") return type;
  return range[1] - range[0] < MOST_AT_A_GLANCE ? "few" : "whole";
}

/** What the ends of a range of numbers are called. */
function ends({ range: [low, high], low_label: lowLabel, high_label: highLabel }) {
  return [
    [low, lowLabel],
    [high, highLabel],
  ]
    .filter(([, label]) => label)
    .map(([n, label]) => paragraph(`${number(n)}: ${label}`, { className: "end" }));
}

const fields = {
  choice: (state) => {
    const part = choices(state.text, state.choices.map((text) => ({ value: text, text })), { name: "answer" });
    return { part, answer: () => chosen(part), missing: w("choose_one") };
  },

  few: (state) => {
    const [low, high] = state.range;
    const options = [];
    for (let n = low; n <= high; n += 1) options.push({ value: String(n), text: number(n) });
    const part = choices(state.text, options, { name: "answer", short: true });
    part.append(...ends(state));
    const answer = () => (chosen(part) === null ? null : Number(chosen(part)));
    return { part, answer, missing: w("choose_one") };
  },

  whole: (state) => {
    const [low, high] = state.range;
    const needed = w("needed_whole", { low: number(low), high: number(high) });
    const part = wholeNumber(state, needed);
    const input = part.querySelector("input");
    part.append(...ends(state));
    return { part, answer: () => (input.value && input.checkValidity() ? Number(input.value) : null), missing: needed };
  },

  "visual-analogue": (state) => {
    const part = analogue(state);
    const answer = () => (isMarked(part) ? Number(part.querySelector("input").value) : null);
    return { part, answer, missing: w("analogue_unset") };
  },

  text: (state) => {
    const part = writing("answer", state.text, { rows: 5, most: 10000 });
    return { part, answer: () => written(part) || null, missing: w("write_something") };
  },
};
