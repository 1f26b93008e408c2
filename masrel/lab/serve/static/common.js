// What both pages share: elements, messages to the server, and news from it.

const csrf = document.querySelector('meta[name="csrf"]').content;

/** An element with properties, listeners (onclick, ...) and children; texts stay texts. */
export function h(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key in element && key !== "list" && key !== "form") element[key] = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** Words with what stands in {braces} filled in. */
export function fill(words, values) {
  return words.replace(/\{(\w+)\}/g, (all, name) => (name in values ? String(values[name]) : all));
}

/** A time in UTC, as the record has it, and beside it what a clock here shows. */
export function momentOf(utc) {
  const moment = new Date(utc);
  if (Number.isNaN(moment.valueOf())) return utc;
  const [day, clock] = moment.toISOString().slice(0, 19).split("T");
  const isSameDay = moment.getDate() === moment.getUTCDate();
  const here = moment.toLocaleString(undefined, { dateStyle: isSameDay ? undefined : "medium", timeStyle: "short" });
  const parts = [h("span", {}, day), " ", h("span", {}, `${clock} UTC`), " ", h("span", { className: "faint" }, `(here ${here})`)];
  return h("time", { dateTime: utc }, ...parts);
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/**
 * Send something, again and again while nobody answers: the server knows what it has
 * already, so that nothing is entered twice. Returns {status, body}; status 0 where
 * `isOver` says that it is not to be sent any more.
 */
export async function post(
  path,
  body = {},
  { every = 700, within = 20000, lost = () => {}, isOver = () => false } = {},
) {
  while (!isOver()) {
    try {
      const answer = await fetch(path, {
        method: "POST",
        headers: { "Content-Type": "application/json", "X-Masrel-CSRF": csrf },
        body: JSON.stringify(body),
        credentials: "same-origin",
        cache: "no-store",
        signal: AbortSignal.timeout(within),
      });
      if (answer.status !== 429) return { status: answer.status, body: parsed(await answer.text()) };
    } catch {
      lost();
    }
    await pause(every);
  }
  return { status: 0, body: {} };
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return { why: text };
  }
}

const SILENT_MS = 15000; // the server says something more often

/**
 * Listen to news. `lost` is called when the server cannot be reached, `back` when it
 * can, `shut` with the reason when it lets this browser in no more.
 */
export function listen(path, handlers, { lost = () => {}, back = () => {}, shut = lost } = {}) {
  let source = null;
  let latest = 0; // when there was news
  let beats = false; // whether this server says that it is there

  const connect = () => {
    source?.close();
    const opened = new EventSource(path);
    source = opened;
    latest = Date.now();
    const news = () => {
      latest = Date.now();
      back();
    };
    opened.onopen = news;
    opened.onerror = () => {
      lost();
      if (opened.readyState === EventSource.CLOSED) refused(path, shut).then(() => setTimeout(connect, 1500));
    };
    opened.addEventListener("beat", () => {
      beats = true;
      news();
    });
    for (const [kind, handle] of Object.entries(handlers)) {
      opened.addEventListener(kind, (event) => {
        news();
        handle(JSON.parse(event.data));
      });
    }
  };
  connect();
  // A tablet that slept, or whose network went, does not wait to be told.
  window.addEventListener("offline", lost);
  window.addEventListener("online", connect);
  const look = () => {
    if (Date.now() - latest < SILENT_MS || !beats || document.hidden) return;
    lost();
    connect();
  };
  setInterval(look, 3000);
  document.addEventListener("visibilitychange", look);
}

/** Say why the server refuses a stream, if that is what it does. */
async function refused(path, shut) {
  try {
    const answer = await fetch(path.replace(/events$/, "state"), { cache: "no-store" });
    if (answer.status === 401 || answer.status === 403) shut(parsed(await answer.text()).why);
  } catch {
    // not there: `lost` was called
  }
}
