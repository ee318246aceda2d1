"use strict";
for (const table of document.querySelectorAll("table.sortable")) {
  const number = (text) => {
    const found = text.replace(/−/g, "-").match(/^\s*±?\s*([-+]?[\d.]+(?:e[-+]?\d+)?)/);
    return found ? Number(found[1]) : NaN;
  };
  const titles = [...table.tHead.rows[0].cells];
  titles.forEach((title, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = title.textContent;
    title.replaceChildren(button);
    button.onclick = () => {
      const falling = title.getAttribute("aria-sort") === "ascending";
      for (const other of titles) other.removeAttribute("aria-sort");
      title.setAttribute("aria-sort", falling ? "descending" : "ascending");
      const body = table.tBodies[0];
      const rows = [...body.rows].map((row) => [row, row.cells[column].textContent.trim()]);
      rows.sort(([, a], [, b]) => {
        if (!a || !b) return (a ? 0 : 1) - (b ? 0 : 1);
        const [x, y] = [number(a), number(b)];
        const order = Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b) : x - y;
        return falling ? -order : order;
      });
      body.append(...rows.map(([row]) => row));
    };
  });
}
