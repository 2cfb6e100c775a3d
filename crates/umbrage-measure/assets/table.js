"use strict";
// Clicks on the headings of #table sort it.
(() => {
  const table = document.getElementById("table"), body = table.tBodies[0], headings = [...table.tHead.rows[0].cells];
  const rows = [...body.rows];
  headings.forEach((heading, column) => heading.firstElementChild.addEventListener("click", () => {
    const ascending = heading.getAttribute("aria-sort") !== "ascending";
    for (const other of headings) other.setAttribute("aria-sort", "none");
    heading.setAttribute("aria-sort", ascending ? "ascending" : "descending");
    const key = (row) => row.cells[column].dataset.key;
    const compare = "words" in heading.dataset
      ? (a, b) => key(a).localeCompare(key(b), "en", { numeric: true })
      : (a, b) => Number(key(a)) - Number(key(b));
    // Unknown figures stay at the end either way.
    const [known, unknown] = [rows.filter((r) => key(r)), rows.filter((r) => !key(r))];
    known.sort((a, b) => (ascending ? compare(a, b) : compare(b, a)));
    body.append(...known, ...unknown);
  }));
})();
