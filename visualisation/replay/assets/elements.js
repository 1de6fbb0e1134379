"use strict";
/* Elements of the document that the panels are made of. */
(function () {
  /** An element with a class and a text. */
  R.make = function (tag, name = "", text = "") {
    const element = document.createElement(tag);
    if (name) element.className = name;
    if (text) element.textContent = text;
    return element;
  };

  /** A button; without an action it is greyed out. */
  R.button = function (text, action, name = "") {
    const element = R.make("button", name, text);
    element.type = "button";
    if (action) element.addEventListener("click", action); else element.disabled = true;
    return element;
  };

  /** A table of [text, class, action] cells. */
  R.table = function (heads, rows) {
    const table = R.make("table"), head = R.make("tr");
    for (const text of heads) head.append(R.make("th", "", text));
    table.append(head);
    for (const row of rows) {
      const line = R.make("tr");
      for (const [text, name, action] of row) {
        const cell = R.make("td", name, action ? "" : text);
        if (action) cell.append(R.button(text, action, "link"));
        line.append(cell);
      }
      table.append(line);
    }
    return table;
  };
})();
