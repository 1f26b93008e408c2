// Order of what a search finds: pages for readers before names, options and records.
const LATER = ["reference/api/", "reference/commands/", "evidence/", "development/"];

var Scorer = {
  score: ([docname, , , , score]) =>
    LATER.some((folder) => docname.startsWith(folder)) ? score - 20 : score,
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
