"use strict";
// Asks the service `runs` and lists what it answers; all texts are set as text, never as markup.

const make = (tag, words = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), words);
  element.append(...children);
  return element;
};
const say = (text) => { document.getElementById("said").textContent = text; };
const seconds = (value) => (typeof value === "number" ? `${value.toFixed(2)} s` : "");
const list = (value) => (Array.isArray(value) ? value : []);

function statesOf(run) {
  const rows = list(run.states).map((one) => make("tr", {},
    make("td", { className: "number", textContent: seconds(one.at) }),
    make("td", { textContent: `${one.agent} ${one.state}` }),
    make("td", { className: "number", textContent: seconds(one.seconds) })));
  return make("table", {}, make("tr", {}, make("th", { textContent: "at" }), make("th", { textContent: "state" }), make("th", { textContent: "for" })), ...rows);
}

function shown(run) {
  const when = typeof run.began === "number" ? new Date(run.began * 1000).toLocaleString() : "";
  const title = make("summary", {}, make("b", { textContent: `${run.rapp || "?"} ${run.version || ""}` }), " ",
    `${run.outcome || ""}, ${seconds(run.seconds)}, ${run.robot}, ${when}`);
  const errors = list(run.errors).map((one) => make("li", { textContent: `${one.agent} ${one.state}: ${one.detail}` }));
  const part = make("details", { className: run.outcome === "failed" ? "failed" : "" }, title, make("ul", {}, ...errors), statesOf(run));
  part.dataset.run = run.run;
  return part;
}

async function show() {
  const robot = document.getElementById("robot").value.trim();
  const response = await fetch("/hop/runs", {
    method: "POST", credentials: "omit", redirect: "error",
    headers: { "Accept-Token": document.getElementById("token").value, "Content-Type": "application/json" },
    body: JSON.stringify(robot ? { robot } : {}),
  });
  const value = await response.json();
  document.getElementById("runs").replaceChildren(...(response.ok ? value.runs.map(shown) : []));
  say(response.ok ? `${value.runs.length} runs` : value.error.message);
}

document.getElementById("enter").addEventListener("submit", (event) => {
  event.preventDefault();
  show().catch((error) => say(`cannot reach the platform: ${error.message}`));
});
