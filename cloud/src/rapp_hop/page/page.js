"use strict";
// Builds a form for each service from the server's OpenAPI document; all texts are set as text, never as markup.

const make = (tag, words = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), words);
  element.append(...children);
  return element;
};
const token = () => document.getElementById("token").value;
const say = (text) => { document.getElementById("said").textContent = text; };

async function call(path, body, json) {
  const headers = { "Accept-Token": token(), Accept: "application/json" };
  if (json) headers["Content-Type"] = "application/json";
  return fetch(path, { method: "POST", headers, body, credentials: "omit", redirect: "error" });
}

function kindOf(schema) {
  const kinds = schema.anyOf ? schema.anyOf.map((one) => one.type).filter((kind) => kind !== "null") : [schema.type];
  return kinds.length === 1 ? kinds[0] : undefined;
}

function field(name, schema, required) {
  const kind = kindOf(schema);
  const input = make(kind === "string" || kind === "integer" || kind === "number" || kind === "boolean" ? "input" : "textarea", { name });
  if (kind === "boolean") input.type = "checkbox";
  if (schema.default !== undefined && schema.default !== null) {
    if (kind === "boolean") input.checked = schema.default;
    else input.value = kind === "string" ? schema.default : JSON.stringify(schema.default);
  }
  const hint = make("span", { className: "hint", textContent: ` ${kind || "JSON"}${required ? "" : ", may be left empty"}` });
  return { input, label: make("label", {}, name, hint, input), read: () => read(input, kind, required) };
}

function read(input, kind, required) {
  if (kind === "boolean") return input.checked;
  if (kind === "string") return input.value === "" && !required ? undefined : input.value;
  return input.value.trim() === "" && !required ? undefined : JSON.parse(input.value);
}

function fileField(name, required) {
  const input = make("input", { name, type: "file" });
  return { input, label: make("label", {}, name, make("span", { className: "hint", textContent: required ? " file" : " file, may be left out" }), input) };
}

async function show(output, response, began) {
  const took = Math.round(performance.now() - began);
  const kind = response.headers.get("Content-Type") || "";
  output.replaceChildren();
  output.classList.toggle("error", !response.ok);
  output.dataset.status = response.status;
  if (kind.startsWith("application/json")) {
    const value = await response.json();
    const text = response.ok ? JSON.stringify(value, null, 2) : `${value.error.kind}: ${value.error.message}`;
    output.append(`${text}\n\n${response.status}, ${took} ms`);
    return;
  }
  const blob = await response.blob();
  const link = make("a", { href: URL.createObjectURL(blob), download: "answer", textContent: `save the file (${blob.size} bytes)` });
  output.append(link, `\n\n${response.status}, ${took} ms`);
}

function formOf(path, operation) {
  const content = operation.requestBody.content;
  const parts = content["multipart/form-data"] && content["multipart/form-data"].schema;
  const plain = parts ? parts.properties.json : content["application/json"].schema;
  const fields = Object.entries(plain.properties).map(([name, schema]) => [name, field(name, schema, (plain.required || []).includes(name))]);
  const files = parts ? Object.keys(parts.properties).filter((name) => name !== "json").map((name) => [name, fileField(name, (parts.required || []).includes(name))]) : [];
  const output = make("pre", { hidden: true });
  const button = make("button", { textContent: "Call" });
  const form = make("form", { noValidate: true }, ...[...fields, ...files].map(([, one]) => one.label), button, output);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    button.disabled = true;
    output.hidden = true;
    const began = performance.now();
    try {
      const values = fields.map(([name, one]) => [name, one.read()]).filter(([, value]) => value !== undefined);
      const json = JSON.stringify(Object.fromEntries(values));
      const chosen = files.filter(([, one]) => one.input.files.length);
      await show(output, await call(path, parts ? multipart(json, chosen) : json, !parts), began);
    } catch (error) {
      output.classList.add("error");
      output.textContent = `cannot call ${path}: ${error.message}`;
    }
    output.hidden = false;
    button.disabled = false;
  });
  return make("details", { id: operation.operationId },
    make("summary", {}, make("code", { textContent: path }), ` ${operation.summary}`), form);
}

function multipart(json, files) {
  const body = new FormData();
  body.append("json", json);
  for (const [name, one] of files) body.append(name, one.input.files[0], one.input.files[0].name);
  return body;
}

document.getElementById("enter").addEventListener("submit", async (event) => {
  event.preventDefault();
  const services = document.getElementById("services");
  services.replaceChildren();
  say("");
  try {
    const response = await call("/hop/openapi", "{}", true);
    const found = await response.json();
    if (!response.ok) throw new Error(found.error.message);
    for (const [path, item] of Object.entries(found.paths)) services.append(formOf(path, item.post));
    say(`${services.children.length} services`);
  } catch (error) {
    say(error.message);
  }
});
