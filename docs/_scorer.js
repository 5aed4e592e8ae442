// Order of the results of a search: pages for users come before the API, the equations, single mechanisms and the bibliography.
const ORDER = [
  [/^(api|zoo|validation)\//, -40],
  [/^(theory\/|references|validation|claims|coming_from|glossary)/, -20],
  [/^(index|install|clearance_joint|wear|couplings)$/, 4],
];
var Scorer = {
  score: ([page, , , , score]) => score + (ORDER.find(([pages]) => pages.test(page)) || [null, 0])[1],
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
