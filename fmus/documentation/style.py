"""The page's style sheet: light and dark, on screen and on paper."""

STYLE = """
:root { color-scheme: light dark; --ink: #1c2330; --soft: #5b6575; --line: #d9dee7;
  --paper: #ffffff; --tint: #f4f6fa; --accent: #1f5fa8; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e8ef; --soft: #9aa5b5; --line: #333c4a; --paper: #14181f; --tint: #1c222c;
    --accent: #7db4f0; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.5rem 4rem; max-width: 64rem; color: var(--ink);
  background: var(--paper); font: 1rem/1.55 system-ui, "Segoe UI", Roboto, "Liberation Sans",
  sans-serif; }
h1 { margin: 0; font-size: 1.9rem; line-height: 1.2; overflow-wrap: anywhere; }
h2 { margin: 2.6rem 0 .8rem; padding-bottom: .3rem; border-bottom: 2px solid var(--line);
  font-size: 1.35rem; }
h3 { margin: 1.8rem 0 .5rem; font-size: 1.08rem; }
h4 { margin: 1.3rem 0 .2rem; font-size: 1rem; font-weight: 600; }
h4 code { font-size: 1.02em; font-weight: 700; }
h4 .note { margin-left: .6rem; font-weight: 400; }
p, ul { margin: .5rem 0; max-width: 46rem; }
ul { padding-left: 1.3rem; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
code { font: .9em ui-monospace, "Cascadia Mono", Consolas, "DejaVu Sans Mono", monospace; }
header p.lead { margin: .4rem 0 0; color: var(--soft); font-size: 1.1rem; }
nav { display: flex; flex-wrap: wrap; gap: .2rem 1.2rem; margin-top: 1rem; padding: .5rem 0;
  border-block: 1px solid var(--line); font-size: .95rem; }
.note { color: var(--soft); font-size: .92rem; }
.table { overflow-x: auto; }
table { border-collapse: collapse; table-layout: fixed; width: 100%; min-width: 52rem;
  font-size: .93rem; line-height: 1.4; }
th, td { padding: .38rem .8rem .38rem 0; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: baseline; }
th { color: var(--soft); font-weight: 600; font-size: .85rem; }
th.name { width: 24%; }
th.unit { width: 9%; }
th.number { width: 8.3%; }
th.role { width: 10%; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }
td.name, td.unit, td:last-child { overflow-wrap: anywhere; }
td.role { color: var(--soft); }
td.name .note { margin-left: .5rem; }
.equation { display: flex; flex-wrap: wrap; align-items: center; gap: .2rem 2rem;
  margin: .55rem 0; padding: .55rem .9rem; overflow: auto hidden; background: var(--tint);
  border-radius: 6px; }
.equation .note { margin-left: auto; }
.equation code { overflow-wrap: anywhere; }
dl.event { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: 0 1rem;
  margin: .4rem 0 1.4rem; }
dl.event dt { padding-top: 1.05rem; color: var(--soft); font-size: .92rem; }
dl.event dd { margin: 0; }
dl.event .note { margin-left: 0; }
.where { display: flex; gap: 1.2rem; flex-basis: 100%; align-items: baseline; }
.where > span { color: var(--soft); font-size: .92rem; }
.where > div > div { margin: .35rem 0; }
math { font-family: "STIX Two Math", "Cambria Math", "Latin Modern Math", "Libertinus Math",
  "DejaVu Math TeX Gyre", "Noto Sans Math", math; }
math { font-size: 1.12em; }
mtable.cases mtd, mtable.lines mtd { text-align: left; }
mtable.cases mtd { padding: .2em .5em; }
mtable.lines mtd { padding: .2em 0; }
footer { margin-top: 3rem; padding-top: .6rem; border-top: 1px solid var(--line);
  color: var(--soft); font-size: .88rem; overflow-wrap: anywhere; }
@media print {
  :root { --ink: #000; --soft: #444; --line: #bbb; --paper: #fff; --tint: #fff; --accent: #000; }
  html { font-size: 9pt; }
  body { max-width: none; padding: 0; }
  table { min-width: 0; }
  nav { display: none; }
  .equation { padding: .1rem 0; overflow: visible; }
  .table { overflow: visible; }
  h2, h3, h4 { break-after: avoid; }
  tr, .equation { break-inside: avoid; } }
"""
