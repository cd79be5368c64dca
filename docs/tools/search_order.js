// Order of the search results: guides before reference, names of Python objects last.
const CHAPTERS = [
  ["getting_started/", 6],
  ["howto/", 6],
  ["gallery/", 4],
  ["validation/trust", 8],
  ["reference/keys/", 3],
  ["reference/glossary", 2],
  ["reference/python", -12],
  ["reference/api/", -14],
  ["reference/modules", -14],
  ["elsewhere/", -8],
  ["development/", -8],
];

var Scorer = {
  score: ([page, , , , score]) => {
    const chapter = CHAPTERS.find(([start]) => page.startsWith(start));
    return score + (chapter ? chapter[1] : 0);
  },
  objNameMatch: 2,
  objPartialMatch: 1,
  objPrio: { 0: 0, 1: -2, 2: -4 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
