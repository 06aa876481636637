// Text from units is only ever set as text, never as markup.
"use strict";
const F = window.FLEET, $ = (id) => document.getElementById(id);
const COLUMNS = ["serial", "kind", "attempt", "time", "operator", "bench", "spec", "verdict", "causes"];
const Q = F.finding.indexOf("quantity"), V = F.finding.indexOf("value"), R = F.finding.indexOf("verdict");
const FIRST = F.finding.indexOf("first"), SHOWN = F.finding.indexOf("shown"), SHOWN_U = F.finding.indexOf("shown_U");
const LO = F.finding.indexOf("lower"), HI = F.finding.indexOf("upper"), U = F.finding.indexOf("U");
const state = { sort: "time", down: true, shown: 100, dark: false, printing: false };
const PAPER_PX = 680; // the plots' width on a sheet of A4
const last = new Map();
for (const j of F.judgements) {
  const held = j.held.length ? ["nonconformance"] : [];
  j.causes = [...held, ...j.findings.filter((f) => f[R] !== "pass").map((f) => f[Q])].join(", ");
  j.why = [...held, ...j.findings.filter((f) => f[R] !== "pass").map((f) => F.labels[f[Q]])].join(", ");
  j.text = [j.serial, j.operator, j.bench, j.causes, ...j.findings.filter((f) => f[R] !== "pass").map((f) => F.labels[f[Q]]), j.lot].join(" ").toLowerCase();
  last.set(j.serial, j);
}

function node(tag, text, cls) {
  const made = document.createElement(tag);
  if (text !== undefined && text !== null) made.textContent = String(text);
  if (cls) made.className = cls;
  return made;
}
function label(name) { return `${F.labels[name]} (${name})`; }
function said(verdict) { return verdict.replace("_", " "); }
function limits(f) {
  if (f[LO] !== null && f[HI] !== null) return `${number(f[LO])} to ${number(f[HI])}`;
  return f[LO] !== null ? `at least ${number(f[LO])}` : f[HI] !== null ? `at most ${number(f[HI])}` : "-";
}
function number(v) { return v === null || v === undefined ? "-" : Number(v.toPrecision(6)).toString(); }
function css(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

function fill(id, values, words) {
  for (const v of [...new Set(values)].sort()) { const o = node("option", words ? words(v) : v); o.value = v; $(id).append(o); }
}
function chosen() {
  const words = $("search").value.toLowerCase().trim();
  const [kind, verdict, bench, who, from, to] = ["kind", "verdict", "bench", "operator", "from", "to"].map((id) => $(id).value);
  return F.judgements.filter((j) =>
    (!words || j.text.includes(words)) && (!kind || j.kind === kind) && (!bench || j.bench === bench) &&
    (!verdict || last.get(j.serial).verdict === verdict) && (!who || j.operator === who) &&
    (!from || j.at.slice(0, 10) >= from) && (!to || j.at.slice(0, 10) <= to));
}
function wilson(k, n) {
  const z = 1.959964, p = k / n, d = 1 + z * z / n, m = (p + z * z / (2 * n)) / d;
  const h = z / d * Math.sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return [Math.max(0, m - h), Math.min(1, m + h)];
}
function layout(more) {
  const axis = { gridcolor: css("--line"), zerolinecolor: css("--line"), linecolor: css("--quiet"), automargin: true };
  const given = more || {};
  return { ...given, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: css("--ink"), size: 13 },
    margin: { l: 60, r: 20, t: 10, b: 45 }, height: 340, width: state.printing ? PAPER_PX : undefined, hovermode: given.hovermode || "closest",
    xaxis: { ...axis, ...given.xaxis }, yaxis: { ...axis, ...given.yaxis } };
}
function plot(id, traces, more) {
  const at = $(id);
  if (!traces.length) { Plotly.purge(at); at.replaceChildren(node("p", "Nothing to show for this choice.", "empty")); return; }
  if (at.querySelector(".empty")) at.replaceChildren();
  Plotly.react(at, traces, layout(more), { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "" });
}
function week(day) { // ISO 8601: the week of its Thursday
  const d = new Date(`${day.slice(0, 10)}T00:00:00Z`);
  d.setUTCDate(d.getUTCDate() + 4 - (d.getUTCDay() || 7));
  return `${d.getUTCFullYear()}-W${String(Math.ceil(((d - Date.UTC(d.getUTCFullYear(), 0, 1)) / 864e5 + 1) / 7)).padStart(2, "0")}`;
}
const GROUPS = { month: (j) => j.at.slice(0, 7), week: (j) => week(j.at), day: (j) => j.at.slice(0, 10), bench: (j) => j.bench, operator: (j) => j.operator, lot: (j) => j.lot };
function drawYield(first) {
  const months = new Map(), of = GROUPS[$("period").value];
  for (const j of first) {
    const row = months.get(of(j)) || [0, 0];
    months.set(of(j), [row[0] + j.passed, row[1] + 1]);
  }
  const rows = [...months].sort(), share = rows.map(([, [k, n]]) => 100 * k / n), ends = rows.map(([, [k, n]]) => wilson(k, n));
  plot("yield-plot", rows.length ? [{ type: "bar", x: rows.map((r) => r[0]), y: share, marker: { color: css("--accent") },
    width: rows.length < 4 ? rows.map(() => 0.3) : undefined, text: rows.map(([, [k, n]]) => `${k} of ${n}`), insidetextanchor: "start", hovertemplate: "%{x}: %{y:.1f} %, %{text}<extra></extra>",
    error_y: { type: "data", symmetric: false, color: css("--quiet"), array: ends.map((e, i) => 100 * e[1] - share[i]),
      arrayminus: ends.map((e, i) => share[i] - 100 * e[0]) } }] : [],
    { xaxis: { type: "category" }, yaxis: { title: { text: "passed at first attempt [%]" }, range: [0, 105] } });
}
function drawCauses(first) {
  const counts = new Map(); // each unit once; what else it has is said beside
  for (const j of first) if (j.stop) {
    const key = `${j.stop[0]} (${said(j.stop[1])})`, [n, also] = counts.get(key) || [0, new Map()];
    for (const word of j.stop[2]) also.set(word, (also.get(word) || 0) + 1);
    counts.set(key, [n + 1, also]);
  }
  const rows = [...counts].sort((a, b) => b[1][0] - a[1][0]).slice(0, 20).reverse();
  const more = rows.map(([, [, also]]) => (also.size ? `also: ${[...also].map(([word, n]) => `${word} ${n}`).join(", ")}` : ""));
  plot("causes-plot", rows.length ? [{ type: "bar", orientation: "h", y: rows.map((r) => r[0]), x: rows.map((r) => r[1][0]), text: more,
    insidetextanchor: "start", marker: { color: css("--bad") }, hovertemplate: "%{y}: %{x} units %{text}<extra></extra>" }] : [], { xaxis: { title: { text: "units" }, dtick: rows.length && rows[rows.length - 1][1][0] < 10 ? 1 : undefined } });
}
function drawTrend(rows) {
  const name = $("quantity").value, by = $("trend-by").value, known = (F.trends[name] || {})[by] || [], shapes = [], points = [];
  for (const j of rows) for (const f of j.findings) if (f[Q] === name && f[V] !== null && f[FIRST]) points.push([j, f]);
  const colours = ["--accent", "--good", "--warn", "--quiet", "--ink"], rang = new Map();
  const mark = (at, color, dash) => at !== null && shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, y0: at, y1: at, line: { color, dash, width: 1 } });
  for (const g of known) for (const a of g.alarms) rang.set(a.first, a.words);
  if (known.length === 1 && known[0].limits) { // limits of several groups over each other say nothing
    mark(known[0].baseline.mean, css("--quiet"), "solid"); mark(known[0].limits.lower, css("--accent"), "dash"); mark(known[0].limits.upper, css("--accent"), "dash");
  }
  for (const k of [LO, HI]) {
    const limits = new Set(points.map((r) => r[1][k]));
    if (limits.size === 1) mark([...limits][0], css("--bad"), "dot");
  }
  const groups = by === "all" ? ["all"] : [...new Set(points.map((r) => r[0][by]))].sort();
  const many = points.length > 150; // bars of U over so many points are a band
  const trace = (of, label, color, symbol) => ({ type: "scatter", mode: "markers", name: label, x: of.map((r) => r[0].at), y: of.map((r) => r[1][V]),
    error_y: { type: "data", array: of.map((r) => r[1][U] || 0), color: css("--quiet"), thickness: 1.2, visible: !many },
    marker: { size: symbol ? 11 : 6, symbol: symbol || "circle", color },
    customdata: of.map((r) => r[0].serial), text: of.map((r) => `${r[0].serial}, ${r[0].at.slice(0, 10)}, ${r[0].bench}: ${r[1][SHOWN]} ± ${r[1][SHOWN_U]}`),
    hovertemplate: "%{text}<extra></extra>" });
  const traces = groups.map((g, i) => trace(by === "all" ? points : points.filter((r) => r[0][by] === g), g, css(colours[i % colours.length])));
  const doubted = points.filter((r) => r[0].doubt.length);
  if (doubted.length) traces.push(trace(doubted, "judged while a golden unit was off", css("--warn"), "circle-open"));
  const marked = points.filter((r) => rang.has(r[0].serial));
  if (marked.length) traces.push(trace(marked, "an alarm begins", css("--bad"), "diamond-open"));
  plot("trend-plot", points.length ? traces : [], { shapes, showlegend: groups.length > 1,
    xaxis: { type: "date", title: { text: "day of measurement" } },
    yaxis: { title: { text: F.labels[name] + (F.quantities[name] && ` [${F.quantities[name]}]`) } } });
  $("marks").textContent = ["Solid and dashed: mean and limits of the process; dotted: limits of the spec", ...(many ? [] : ["bars: U (k = 2)"]),
    ...(doubted.length ? ["circled: judged while a golden unit was off"] : []), ...(marked.length ? ["diamonds: an alarm begins"] : [])].join("; ") + ".";
  const list = $("alarms"); list.replaceChildren();
  const alarm = (words, rings) => list.append(node("li", (rings ? "" : "to be watched: ") + words, rings ? "fail" : "watch"));
  for (const words of F.goldens[name] || []) alarm(`golden unit ${words}`, F.rings.goldens.includes(words));
  for (const words of F.golden_notes[name] || []) list.append(node("li", words));
  for (const g of known) {
    const title = by === "all" ? "" : `${by} ${g.group}: `, base = g.baseline;
    for (const a of g.alarms) alarm(title + a.words, a.rings);
    if (!g.alarms.length) list.append(node("li", `${title}no alarm in ${g.n} units`));
    if (base) list.append(node("li", `${title}compared with ${base.since ? `the baseline of ${base.since} to ${base.until}` : "the values themselves"} (${base.n} units)` +
      (g.Ppk === null ? "" : `; Cpk ${g.Cpk.toFixed(2)}, Ppk ${g.Ppk.toFixed(2)}`)));
    const unit = F.quantities[name] && ` ${F.quantities[name]}`, size = (of) => of.toPrecision(2) + unit;
    if (g.findable.own) list.append(node("li", `${title}a shift of half of these units is found in nine of ten such charts from ${size(g.findable.own)} on, and rings from ${size(g.findable.ring)} on`));
    for (const c of g.cautions) list.append(node("li", title + c));
  }
}
function drawHappenings() {
  $("rings").textContent = `${F.rings.alarms} alarms ring, ${F.rings.watched} more are to be watched; in charts by bench and lot ${F.rings.of_groups} ring. Where nothing changed, anything rings on ${100 * F.rings.chance} % of such pages; what is to be watched is rare for its own chart alone.`;
  const [from, to] = ["from", "to"].map((id) => $(id).value), body = $("happened").tBodies[0]; body.replaceChildren();
  for (const h of F.happenings.filter((each) => (!from || each.day >= from) && (!to || each.day <= to))) {
    const row = node("tr"); row.append(...["day", "kind", "unit", "who", "words"].map((key) => node("td", h[key]))); body.append(row);
  }
}
function drawCurves(rows) {
  const serials = new Set(rows.map((j) => j.serial)), all = F.curves[$("picture").value] || [];
  const some = all.filter((c) => serials.has(c.serial));
  plot("curves-plot", some.map((c) => ({ type: "scatter", mode: "lines", name: c.serial, x: c.x, y: c.y, line: { width: 1.2 },
    hovertemplate: `${c.serial}: %{x}, %{y}<extra></extra>` })), some.length ? { xaxis: { title: { text: some[0].x_label }, type: some[0].x_log ? "log" : "linear" },
    yaxis: { title: { text: some[0].y_label }, type: some[0].y_log ? "log" : "linear" } } : {});
}
function drawGap(rows) {
  const counts = new Map();
  for (const j of rows) if (j.gap && !j.simulated) for (const name of j.gap.named.length ? j.gap.named : [j.gap.verdict]) counts.set(name, (counts.get(name) || 0) + 1);
  const sorted = [...counts].sort((a, b) => a[1] - b[1]);
  plot("gap-plot", sorted.length ? [{ type: "bar", orientation: "h", y: sorted.map((r) => r[0]), x: sorted.map((r) => r[1]), marker: { color: css("--accent") } }] : [],
    { xaxis: { title: { text: "units" } } });
}
function drawTable(rows) {
  const sign = state.down ? -1 : 1;
  const sorted = [...rows].sort((a, b) => (a[state.sort] < b[state.sort] ? -sign : a[state.sort] > b[state.sort] ? sign : 0));
  const body = $("table").tBodies[0], fresh = document.createDocumentFragment();
  for (const j of sorted.slice(0, state.shown)) {
    const row = node("tr"); row.tabIndex = 0; row.dataset.serial = j.serial;
    for (const c of COLUMNS) row.append(node("td", c === "time" ? j.time.replace("T", " ").slice(0, 16) : c === "causes" ? j.why : c === "operator" ? j.by : c === "verdict" ? [j[c], ...(j.simulated ? ["simulated"] : []), ...(j.golden ? ["golden unit"] : [])].join(", ") : j[c], c === "verdict" ? j.verdict : c));
    fresh.append(row);
  }
  body.replaceChildren(fresh);
  $("more").hidden = sorted.length <= state.shown;
  $("left").textContent = sorted.length > state.shown ? `${state.shown} of ${sorted.length} judgements` : "";
}
function show(serial) {
  const body = $("detail-body"); body.replaceChildren(node("h2", serial));
  for (const j of F.judgements.filter((k) => k.serial === serial).reverse()) {
    const head = node("h3", `Attempt ${j.attempt}: `); head.append(node("span", j.verdict, j.verdict)); body.append(head);
    body.append(node("p", `${j.simulated ? "simulated" : "measured"} ${j.at.slice(0, 10)}, judged ${j.time.replace("T", " ")} UTC, ${j.by}, bench: ${j.bench}, spec ${j.spec}`));
    if (j.voided) body.append(node("p", `void: ${j.voided}`));
    for (const words of j.doubt) body.append(node("p", words, "fail"));
    if (j.certificate) { const link = node("a", "certificate (PDF)"); link.href = j.certificate; body.append(link); }
    const table = node("table"), top = node("tr");
    for (const t of ["quantity", "value", "U", "limits", "verdict", "reason"]) top.append(node("th", t));
    table.append(top);
    for (const f of j.findings) {
      const row = node("tr"), unit = F.quantities[f[Q]];
      row.append(node("td", label(f[Q])), node("td", f[V] === null ? "-" : `${f[SHOWN]} ${unit}`), node("td", f[SHOWN_U]),
        node("td", limits(f)), node("td", said(f[R]), f[R]), node("td", f[F.finding.indexOf("reason")] || ""));
      table.append(row);
    }
    body.append(table);
    if (j.gap) body.append(node("p", `Gap analysis: ${j.gap.verdict}${j.gap.named.length ? `; named: ${j.gap.named.join(", ")}` : ""}`));
    for (const n of [...j.held.map((words) => `held until quality assurance decides: ${words}`), ...j.dispositions, ...j.notes]) body.append(node("p", n));
  }
  $("detail").hidden = false; $("close").focus(); location.hash = `unit=${encodeURIComponent(serial)}`;
}
function close() { $("detail").hidden = true; history.replaceState(null, "", "#units"); }
let timer;
function pictures(rows) {
  const first = rows.filter((j) => j.first);
  drawYield(first); drawCauses(first); drawTrend(rows); drawCurves(rows); drawGap(rows);
  for (const part of document.querySelectorAll("#gap, nav a[href='#gap']")) part.hidden = !F.judgements.some((j) => j.gap);
}
function colours() { document.documentElement.classList.toggle("dark", state.dark && !state.printing); }
function paper(on) { // dark ink on white, as wide as the sheet
  state.printing = on; colours();
  for (const at of document.querySelectorAll(".plot")) Plotly.purge(at); // a plot that is only drawn again keeps its width
  pictures(chosen());
}
function draw() {
  const rows = chosen();
  const tested = rows.filter((j) => !j.golden), units = new Set(tested.map((j) => j.serial)), golden = rows.length - tested.length;
  const good = [...units].filter((s) => last.get(s).verdict === "accepted").length;
  $("summary").textContent = `${units.size} units, ${tested.length} judgements, ${good} accepted` +
    (golden ? `; beside them ${golden} ${golden > 1 ? "judgements" : "judgement"} of golden units` : "") +
    (F.of > F.judgements.length ? `; this page has ${F.days.some(Boolean) ? "" : "the last "}${F.judgements.length} of ${F.of} judgements` : "") +
    (F.days.some(Boolean) ? `; measured ${F.days[0] ? `from ${F.days[0]} ` : ""}${F.days[1] ? `until ${F.days[1]}` : "on"}` : "") +
    `. Made ${F.made}, up to event ${F.head} of the store.`;
  drawTable(rows); drawHappenings();
  clearTimeout(timer); // the table answers at once; the pictures follow
  timer = setTimeout(() => { pictures(rows); document.body.dataset.drawn = rows.length; }, 0);
}
for (const id of ["kind", "bench", "operator"]) fill(id, F.judgements.map((j) => j[id]));
fill("verdict", F.judgements.map((j) => j.verdict));
fill("quantity", Object.keys(F.quantities), label);
fill("picture", Object.keys(F.curves));
for (const part of document.querySelectorAll("#curves, nav a[href='#curves']")) part.hidden = !Object.keys(F.curves).length;
for (const c of COLUMNS) {
  const th = node("th"), b = node("button", c === "time" ? "time (UTC)" : c); b.type = "button";
  b.addEventListener("click", () => { state.down = state.sort === c ? !state.down : false; state.sort = c; draw(); });
  th.append(b); $("table").tHead.rows[0].append(th);
}
for (const id of ["search", "kind", "verdict", "bench", "operator", "from", "to"]) $(id).addEventListener("input", () => { state.shown = 100; draw(); });
for (const id of ["quantity", "picture", "period", "trend-by"]) $(id).addEventListener("input", draw);
$("reset").addEventListener("click", () => { for (const id of ["search", "kind", "verdict", "bench", "operator", "from", "to"]) $(id).value = ""; draw(); });
$("more").addEventListener("click", () => { state.shown += 200; draw(); });
$("close").addEventListener("click", close);
$("theme").addEventListener("click", () => { state.dark = !state.dark; colours(); draw(); });
addEventListener("beforeprint", () => paper(true));
addEventListener("afterprint", () => paper(false));
$("table").addEventListener("click", (e) => { const row = e.target.closest("tr[data-serial]"); if (row) show(row.dataset.serial); });
document.addEventListener("keydown", (e) => {
  const row = document.activeElement.closest && document.activeElement.closest("tr[data-serial]");
  if (e.key === "Escape" && !$("detail").hidden) close();
  else if (e.key === "/" && document.activeElement.tagName !== "INPUT") { e.preventDefault(); $("search").focus(); }
  else if (row && e.key === "Enter") { e.preventDefault(); show(row.dataset.serial); } // else the button in focus is pressed
  else if (row && e.key === "ArrowDown" && row.nextSibling) { e.preventDefault(); row.nextSibling.focus(); }
  else if (row && e.key === "ArrowUp" && row.previousSibling) { e.preventDefault(); row.previousSibling.focus(); }
});
state.dark = matchMedia("(prefers-color-scheme: dark)").matches;
colours();
draw();
const asked = decodeURIComponent(location.hash.slice(1));
if (asked.startsWith("unit=") && last.has(asked.slice(5))) show(asked.slice(5));
