// SPDX-License-Identifier: Apache-2.0
// The page in a real browser, on a real dlcsd: submit, watch, reload, cancel, errors, tokens, ten tabs, looks.
//
// Environment: DLCSD, the program; PROJECT, the folder of the project. Screenshots go into the folder `shots` where it
// runs.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";

import { chromium } from "playwright-core";

import { Dlcsd } from "./dlcsd.mjs";

const kPatience = { timeout: 60_000 };
const chromiumPath = "/usr/bin/chromium"; // Debian's; run.sh looks for it
const example = (name) => readFileSync(path.join(process.env.PROJECT, "deploy/examples", `${name}.json`), "utf8");

let dlcsd, browser;
const complaints = []; // of the console, of scripts and of failed requests

before(async () => {
  mkdirSync("shots", { recursive: true });
  dlcsd = await Dlcsd.start();
  browser = await chromium.launch({ executablePath: chromiumPath, args: ["--no-sandbox"] });
});
after(async () => {
  await browser?.close();
  await dlcsd?.stop();
});

async function newContext(options = {}) {
  return browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
}

async function open(context, hash = "", url = dlcsd.url) {
  const page = await context.newPage();
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(`${url}/${hash}`);
  return page;
}

async function submit(page, problem, { method, steps } = {}) {
  await page.waitForSelector("#method option:nth-child(3)", { state: "attached", ...kPatience });
  await page.fill("#problem", problem);
  if (method) await page.selectOption("#method", { label: method });
  if (steps) await page.fill("#steps", String(steps));
  await page.click("button.main[type=submit]");
}

const submitted = (page) => page.waitForSelector(".head", kPatience);
const verdict = async (page) => {
  await page.waitForSelector(".verdict:not([hidden])", kPatience);
  return page.textContent(".verdict");
};
// The number of the last iteration that is shown.
const iteration = (page) =>
  page.evaluate(() => {
    const text = [...document.querySelectorAll(".now")].map((element) => element.textContent).join("#");
    return Number(text.match(/iteration (\d[\d,]*):/)?.[1].replaceAll(",", "") ?? -1);
  });
const iterationAbove = async (page, number) => {
  for (let k = 0; k < 300; ++k) {
    const now = await iteration(page);
    if (now > number) return now;
    await page.waitForTimeout(100);
  }
  return assert.fail(`no iteration above ${number} was shown`);
};
// Repeats `check` until it holds: what is drawn follows some frames later.
async function eventually(page, check) {
  for (let k = 0; k < 100; ++k) {
    try {
      return await check();
    } catch (error) {
      if (!(error instanceof assert.AssertionError)) throw error;
      await page.waitForTimeout(100);
    }
  }
  return check();
}
const fits = (page) => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);

// Long enough to be watched: thousands of iterations.
const long = { method: "wu-chen-iteration", steps: 800 };

test("is small", async () => {
  const html = await (await fetch(dlcsd.url)).text();
  const files = [...html.matchAll(/(?:src|href)="([^"]+)"/g)].map(([, name]) => name);
  assert.ok(files.length >= 3);
  let bytes = 0;
  for (const file of ["", ...files]) {
    const response = await fetch(`${dlcsd.url}/${file}`, { headers: { "accept-encoding": "gzip" } });
    assert.equal(response.status, 200, file);
    bytes += Number(response.headers.get("content-length"));
  }
  assert.ok(bytes < 150_000, `${bytes} bytes`);
});

test("submits, shows iterates as they arrive, and continues after a reload", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  await submit(page, example("four-variables"), long);
  await submitted(page);
  const first = await iterationAbove(page, 0);
  const later = await iterationAbove(page, first);
  await page.screenshot({ path: "shots/running.png", fullPage: true });
  await page.reload();
  await iterationAbove(page, later);
  assert.match(await verdict(page), /SOLVED|ERROR_ESTIMATED|error/i);
  await page.screenshot({ path: "shots/finished.png", fullPage: true });
  // The list has it too.
  await page.goto(`${dlcsd.url}/#/jobs`);
  await page.waitForSelector(".jobs tbody tr", kPatience);
  await page.screenshot({ path: "shots/jobs.png" });
  await context.close();
});

test("cancels", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  await submit(page, example("four-variables"), long);
  await submitted(page);
  await iterationAbove(page, 0);
  await page.click("text=Cancel");
  assert.match(await verdict(page), /cancel|stopped/i);
  await context.close();
});

// x' = x, and a pair that does nothing; each of the `ends` is the horizon of a member.
async function createEnsemble(ends, options, title = "") {
  const dense = (value) => ({ dense: { rows: 1, columns: 1, values: [value] } });
  const constant = (value) => ({ pieces: [{ constant: { values: [value] } }] });
  const matrices = { a: dense(1), b: dense(0), n: dense(0), m: dense(1) };
  const problem = { ...matrices, f: constant(0), g: constant(1), x0: [1], horizon: 1 };
  const ensemble = { problem, options, members: ends.map((horizon) => ({ horizon })) };
  const response = await fetch(`${dlcsd.url}/dlcs.v1.JobService/CreateEnsembleJob`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ ensemble, title, shardMembers: 20 }),
  });
  assert.equal(response.status, 200);
  return (await response.json()).name;
}

test("shows how far an ensemble is, and how its members ended", async () => {
  const context = await newContext();
  // One of them grows beyond all numbers.
  const ends = [...Array(59).fill(1), 1000];
  const name = await createEnsemble(ends, { errorTolerance: 1e-6 }, "sixty ends");
  const page = await open(context, "#/jobs");
  const row = page.locator(".jobs tbody tr", { hasText: "sixty ends" });
  await row.getByText("Ensemble: 60 members, 1 failed, 1 state, 1 pair").waitFor(kPatience);
  await row.getByText("took").waitFor(kPatience);
  await page.fill("#search", "ensemble");
  assert.equal(await page.locator(".jobs tbody tr").count(), 1);
  await page.screenshot({ path: "shots/ensembles.png" });
  await row.getByRole("link").click();
  await page.getByText("60 members, 1 failed, created").waitFor(kPatience);
  await page.getByText(`dlcs result ${name}`).waitFor(kPatience);
  await page.screenshot({ path: "shots/ensemble.png" });

  // A running job can be cancelled.
  const long = await createEnsemble(Array(4000).fill(1), { steps: 100_000, method: "METHOD_TIME_STEPPING" });
  await page.goto(`${dlcsd.url}/#/${long}`);
  await page.getByText("Untitled ensemble").waitFor(kPatience);
  await page.getByText(/\d+ of 4,000 members/).waitFor(kPatience);
  await page.click("text=Cancel");
  await page.getByText(/Took .*, \d+ of 4,000 members, created/).waitFor(kPatience);
  await context.close();
});

test("shows what is wrong with a problem at its field", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  await submit(page, '{"A": [[-1]], "B": [[1]], "N": [[1]],\n "M": [[1]], "x0": [0],\n "speed": 3, "T": -1}');
  await page.waitForSelector("#problem-errors:not(:empty)", kPatience);
  const said = await page.textContent("#problem-errors");
  assert.match(said, /speed/);
  assert.match(said, /T/);
  await page.screenshot({ path: "shots/schema-errors.png" });
  // Errors that only the server can find.
  await submit(page, '{"A": [[-1, 2]], "B": [[1]], "N": [[1]],\n "M": [[1]], "f": ["sin(q*t)"], "x0": [0], "T": 1}');
  await page.waitForFunction(() => !document.querySelector("#problem-errors").textContent.includes("speed"));
  await page.waitForSelector("#problem-errors:not(:empty)", kPatience);
  assert.match(await page.textContent("#problem-errors"), /A/);
  await page.screenshot({ path: "shots/server-errors.png" });
  await context.close();
});

// z follows the difference of two states that are equal but for 1e-9: of 1e-9 of z, rounding leaves nothing.
test("takes absolute tolerances, and says which names there are", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  const problem = `{"states": ["a", "b", "z"], "A": [[-1, 0, 0], [0, -1, 0], [1e3, -1e3, -1]], "B": [[0], [0], [0]],
    "N": [[0, 0, 0]], "M": [[1]], "f": ["sin(t)", "sin(t)", "0"], "g": ["1"], "x0": [1, 1.000000001, 0], "T": 5,
    "outputs": {"names": ["v(a,b)"], "C": [[1, -1, 0]], "D": [[0]], "h": [0]}}`;
  await page.fill("#tolerance", "1e-8");
  for (const [text, rule] of [
    ["z", "is z; must be a number at least 0, or NAME=number"],
    ["z=-1", "is z=-1; must be a number at least 0"],
    ["1e-9, V(a,b)=1e-9", "did you mean v(a,b)?"],
  ]) {
    await page.fill("#absolute", text);
    await submit(page, problem);
    await page.locator("#absolute-error", { hasText: rule }).waitFor(kPatience);
  }
  await page.fill("#absolute", "1e-15, v(a,b)=1e-12, z=1e-9");
  await submit(page, problem);
  assert.match(await verdict(page), /SOLVED within an error of 1e-0?8/);
  await context.close();
});

test("tells answers that are of no use from others", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  const wrongStart = '{"A": [[0]], "B": [[1]], "N": [[1]], "M": [[0]], "x0": [-1], "T": 1}';
  const wave = '{"A": [[0, 1], [-400, 0]], "B": [[0], [1]], "N": [[1, 0]], "M": [[0.001]], "x0": [1, 0], "T": 20}';
  for (const [problem, options, said] of [
    [wrongStart, {}, "INCONSISTENT_STATE"],
    [wave, { method: "time-stepping", steps: 100 }, "inaccurate"],
  ]) {
    await page.goto(`${dlcsd.url}/#/submit`);
    await submit(page, problem, options);
    await verdict(page);
    await page.locator('.head .state[data-state="failed"]').getByText(said).waitFor(kPatience);
    await page.goto(`${dlcsd.url}/#/jobs`);
    await page.locator(".jobs tbody tr").first().getByText(said).waitFor(kPatience);
    await page.screenshot({ path: `shots/${said.replace(" ", "-")}.png` });
  }
  await context.close();
});

// Records what the plots of pages draw: their labels and, of marked switches, how many.
async function recordPlots(context) {
  await context.addInitScript(() => {
    const drawn = new WeakMap();
    const of = ({ canvas }) => drawn.get(canvas) ?? drawn.set(canvas, { labels: [], marks: 0 }).get(canvas);
    const wrap = (name, before, { prototype } = CanvasRenderingContext2D) => {
      const original = prototype[name];
      prototype[name] = function (...parameters) {
        before(this, parameters);
        return original.apply(this, parameters);
      };
    };
    window.heights = []; // of the points of all lines
    wrap("lineTo", (_, [, y]) => window.heights.push(y), Path2D);
    wrap("clearRect", ({ canvas }) => drawn.delete(canvas));
    wrap("fillText", (context, [text, left, top]) => {
      const { x, y } = context.getTransform().transformPoint(new DOMPoint(left, top));
      of(context).labels.push({ text, x, y, width: context.measureText(text).width });
    });
    wrap("stroke", (context) => {
      if (context.getLineDash().join() === "3,4") ++of(context).marks;
    });
    window.drawnIn = (canvas) => canvas && { ...drawn.get(canvas), width: canvas.width };
  });
}
// Of the plot with this number.
const drawn = async (page, place = 0) => {
  const what = await page.evaluate((k) => window.drawnIn(document.querySelectorAll(".plot canvas")[k]), place);
  assert.ok(what?.labels, "nothing is drawn yet");
  return what;
};

test("shows the outputs of a job that has ended, over times of microseconds", async () => {
  const submitting = await newContext();
  const first = await open(submitting, "#/submit");
  await submit(
    first,
    `{"A": [[-1e5]], "B": [[1e5]], "N": [[1]], "M": [[1]], "f": ["1e5*sin(1e6*t)"], "x0": [0], "T": 2e-5,
      "outputs": {"names": ["t", "twice"], "C": [[1], [2]]}}`,
  );
  await verdict(first);
  const hash = new URL(first.url()).hash;
  await submitting.close();
  // The page knows of it only what the server sends.
  const context = await newContext({ acceptDownloads: true });
  await recordPlots(context);
  const page = await open(context, hash);
  await page.getByRole("heading", { name: "Outputs" }).waitFor(kPatience);
  await page.getByRole("heading", { name: "States x" }).waitFor(kPatience);
  const { along, width } = await eventually(page, async () => {
    const { labels, width } = await drawn(page);
    const bottom = Math.max(...labels.filter(({ text }) => text !== "t").map(({ y }) => y));
    const along = labels.filter(({ y }) => y === bottom).sort((a, b) => a.x - b.x);
    assert.ok(along.length > 5 && along.at(-1).text === "2e-5", JSON.stringify(labels));
    return { along, width };
  });
  for (const [k, label] of along.entries()) {
    assert.ok(label.x + label.width / 2 <= width, `${label.text} is cut off`);
    const next = along[k + 1];
    const gap = next && next.x - next.width / 2 - (label.x + label.width / 2);
    assert.ok(!next || gap > 4, `${label.text} touches ${next?.text}`);
  }
  await page.screenshot({ path: "shots/outputs.png", fullPage: true });
  const [file] = await Promise.all([page.waitForEvent("download", kPatience), page.click(".files >> text=CSV")]);
  assert.match(readFileSync(await file.path(), "utf8"), /^t,output:t,twice\n/);
  await context.close();
});

test("tells the labels of a large value that hardly changes apart, and draws its line smoothly", async () => {
  const context = await newContext();
  await recordPlots(context);
  const page = await open(context, "#/submit");
  await submit(
    page,
    '{"A": [[-1]], "B": [[0]], "N": [[0]], "M": [[1]], "f": ["1e6"], "g": ["1"], "x0": [1000000.001], "T": 1}',
  );
  await verdict(page);
  await eventually(page, async () => {
    const { labels } = await drawn(page);
    const left = Math.min(...labels.map(({ x }) => x));
    const beside = labels.filter(({ x }) => x === left).map(({ text }) => text);
    assert.ok(beside.length > 2, JSON.stringify(labels));
    assert.equal(new Set(beside).size, beside.length, beside.join());
    assert.equal(beside[0], "1e6"); // and the others are so much above it
  });
  const heights = await page.evaluate(() => window.heights);
  const between = heights.filter((y) => Math.abs(y - Math.round(y)) > 0.01).length;
  assert.ok(between > 500, `${between} of ${heights.length} points between pixels`);
  await page.screenshot({ path: "shots/offset.png", fullPage: true });
  await context.close();
});

test("marks the switches of the pairs that it shows", async () => {
  const context = await newContext();
  await recordPlots(context);
  const page = await open(context, "#/submit");
  await submit(
    page,
    `{"A": [[-1]], "B": [[1, 1]], "N": [[0], [0]], "M": [[1, 0], [0, 1]],
      "g": ["-sin(2*pi*t+1)", "-sin(40*pi*t+1)"], "x0": [0], "T": 1}`,
  );
  await verdict(page);
  // A sine has two zeros in a period.
  await eventually(page, async () => assert.equal((await drawn(page)).marks, 42));
  await page.getByLabel("y2").uncheck();
  await eventually(page, async () => assert.equal((await drawn(page)).marks, 2));
  await context.close();
});

test("says why there are no iterations", async () => {
  const context = await newContext();
  const page = await open(context, "#/submit");
  await submit(page, example("oscillator-with-stop"));
  await verdict(page);
  await page.getByText("A solve within a tolerance reports no iterations.").waitFor(kPatience);
  assert.equal(await page.getByLabel("Only the last window").isVisible(), false);
  await context.close();
});

test("shows what is known of a periodic solution", async () => {
  const dense = (value) => ({ dense: { rows: 1, columns: 1, values: [value] } });
  const formula = (text) => ({ pieces: [{ formulas: { formulas: [text] } }] });
  const problem = {
    ...{ a: dense(-0.01), b: dense(0), n: dense(0), m: dense(1) },
    ...{ f: formula("sin(3*t)+0.02"), g: formula("1"), x0: [5], horizon: 10 },
  };
  const response = await fetch(`${dlcsd.url}/dlcs.v1.JobService/CreateSolveJob`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ solve: { problem, options: { period: (2 * Math.PI) / 3 } } }),
  });
  const { name } = await response.json();
  const context = await newContext();
  await recordPlots(context);
  const page = await open(context, `#/${name}`);
  await page.getByRole("heading", { name: "Periodic solution" }).waitFor(kPatience);
  const fact = (term) => page.locator(".facts div", { hasText: term }).locator("dd").first().textContent();
  assert.equal(await fact("Multipliers"), Math.exp((-0.01 * 2 * Math.PI) / 3).toPrecision(6));
  assert.equal(await fact("Stability"), "stable: disturbances shrink by 2.1 % a period");
  assert.equal(await fact("Averages of x"), "x1 2");
  // y is 0, and its axis ends at 1.
  await eventually(page, async () => {
    const { labels } = await drawn(page, 1);
    assert.ok(labels.some(({ text }) => text === "0.75"));
    assert.deepEqual(labels.map(({ text }) => text).filter((text) => Number(text) > 2.1), [], "labels of y");
  });
  await page.screenshot({ path: "shots/periodic.png", fullPage: true });
  await context.close();
});

test("downloads what the command line writes", async () => {
  const context = await newContext({ acceptDownloads: true });
  const page = await open(context, "#/submit");
  await submit(page, example("rectifier"));
  assert.match(await verdict(page), /SOLVED|error/i);
  for (const kind of ["JSON", "CSV", "NPY"]) {
    const [file] = await Promise.all([page.waitForEvent("download", kPatience), page.click(`.files >> text=${kind}`)]);
    const bytes = readFileSync(await file.path());
    if (kind === "JSON") assert.ok(JSON.parse(bytes.toString()).trajectory.x.length > 0);
    if (kind === "CSV") assert.match(bytes.toString().split("\n")[0], /^t,x1,y1,w1/);
    if (kind === "NPY") assert.equal(bytes.subarray(1, 6).toString(), "NUMPY");
  }
  await context.close();
});

test("looks right in the dark and on narrow screens", async () => {
  for (const [name, options] of Object.entries({
    dark: { colorScheme: "dark" },
    narrow: { viewport: { width: 320, height: 640 } },
  })) {
    const context = await newContext(options);
    const page = await open(context, "#/submit");
    await page.waitForSelector("#method option:nth-child(3)", { state: "attached", ...kPatience });
    assert.ok(await fits(page), `${name}: the form`);
    await submit(page, example("rectifier"));
    await verdict(page);
    await page.waitForTimeout(500);
    assert.ok(await fits(page), name);
    await page.screenshot({ path: `shots/${name}.png`, fullPage: true });
    await context.close();
  }
});

test("ten tabs hold one stream, and the tenth submits", async () => {
  const context = await newContext();
  const first = await open(context, "#/submit");
  await submit(first, example("four-variables"), long);
  await submitted(first);
  const hash = new URL(first.url()).hash;
  const tabs = [first];
  while (tabs.length < 9) tabs.push(await open(context, hash));
  const tenth = await open(context, "#/submit");
  await submit(tenth, example("rectifier"));
  await verdict(tenth);
  const held = await first.evaluate(async () => (await navigator.locks.query()).held.length);
  assert.ok(held <= 1, `${held} streams`);
  await context.close();
});

test("shows a solve of a server that keeps none", async () => {
  const storeless = await Dlcsd.startWithoutStore();
  try {
    const context = await newContext();
    const page = await open(context, "#/submit", storeless.url);
    await submit(page, example("four-variables"), long);
    await iterationAbove(page, 0);
    await page.click("text=Cancel");
    assert.match(await verdict(page), /CANCELLED/);
    await page.locator('.head .state[data-state="cancelled"]').getByText("cancelled").waitFor(kPatience);
    await page.reload();
    await page.getByText("There is no solve in this tab. A server without --store keeps none").waitFor(kPatience);
    await context.close();
  } finally {
    await storeless.stop();
  }
});

test("goes on where a server that was killed comes back", async () => {
  let server = await Dlcsd.start();
  try {
    const context = await newContext();
    const page = await context.newPage(); // whose console reports the calls that nobody answers
    await page.goto(`${server.url}/#/submit`);
    await submit(page, example("four-variables"), long);
    await submitted(page);
    await iterationAbove(page, 1);
    await server.kill();
    await page.getByText("The server does not answer.").waitFor(kPatience);
    await page.screenshot({ path: "shots/server-gone.png", fullPage: true });
    server = await server.restart();
    assert.match(await verdict(page), /reached T/);
    assert.equal(await page.getByText("The server does not answer.").isVisible(), false);
    await page.getByText("1 window, none of them tried again").waitFor(kPatience);
    await page.getByText(/^Window 0, iteration \d+/).waitFor(kPatience);
    await page.screenshot({ path: "shots/server-back.png", fullPage: true });
    await context.close();
  } finally {
    await server.stop();
  }
});

test("asks for a token where there are users", async () => {
  const folder = dlcsd.folder;
  const saved = path.join(folder, "alice.token");
  writeFileSync(
    path.join(folder, "tokens.txt"),
    execFileSync(process.env.DLCSD, ["token", "alice", "--right", "submitter", "--save", saved]),
  );
  const guarded = await Dlcsd.start("--tokens", path.join(folder, "tokens.txt"));
  try {
    const context = await newContext();
    const page = await open(context, "", guarded.url);
    const enter = async (token) => {
      await page.waitForSelector("dialog", kPatience);
      await page.fill("#token", token);
      await page.keyboard.press("Enter");
    };
    await enter("wrong");
    await page.waitForTimeout(500);
    await enter(readFileSync(saved, "utf8").trim());
    await page.waitForSelector("dialog", { state: "detached", ...kPatience });
    assert.ok(!page.url().includes("dlcs_"));
    await page.goto(`${guarded.url}/#/submit`);
    await submit(page, example("rectifier"));
    assert.match(await verdict(page), /SOLVED|error/i);
    await context.close();
  } finally {
    await guarded.stop();
  }
});

test("leaves the console clean", () => {
  assert.deepEqual(complaints, []);
});
