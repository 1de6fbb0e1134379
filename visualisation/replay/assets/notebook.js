"use strict";
/* The page of a run that goes on in a cell of a notebook. What there is of it is a message of the cell. The page says when it is ready to be told. */
(function () {
  const READY = "remoras-ready", root = document.getElementById("app");
  R.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  R.growing = new R.Growing(root, (text) => root.prepend(R.make("p", "message bad", text)));
  addEventListener("message", (event) => {
    if (event.source !== parent || typeof event.data !== "string") return;
    R.growing.take(event.data);
  });
  parent.postMessage(READY, "*");
})();
