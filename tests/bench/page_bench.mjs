// SPDX-License-Identifier: Apache-2.0
// The page in Chromium, and streams over HTTP, on a real dlcsd: how soon the page is there, how smoothly long
// trajectories move, how old an iteration is when it is seen, and what readers of streams cost the server.
//
//     tests/web/run.sh tests/bench/page_bench.mjs build/ci/tests/web [QUESTION...]
//
// Questions: paint, move, age, streams, watchers; without one: all.
//
// Environment: DLCSD, DLCS, the programs; PROJECT, the folder of the project. Times are wall-clock times except where
// processor time is named. All programs share this machine, so keep it quiet.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import net from "node:net";
import { tmpdir } from "node:os";
import path from "node:path";
import tls from "node:tls";

import { chromium } from "playwright-core";

import { Dlcsd } from "./dlcsd.mjs";

const example = (name) => path.join(process.env.PROJECT, "deploy/examples", `${name}.json`);
const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const percentile = (values, part) =>
  [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor((part / 100) * values.length))];
const told = (values) => {
  const [middle, most, max] = [50, 99, 100].map((part) => percentile(values, part).toFixed(0));
  return `p50 ${middle}, p99 ${most}, max ${max} ms`;
};
const say = (text) => console.log(text);

// Of a process, from /proc.
const clockTicks = 100;
function processorSeconds(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ");
  return (Number(fields[11]) + Number(fields[12])) / clockTicks;
}
const residentMb = (pid) => Number(/VmRSS:\s*(\d+)/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))[1]) / 1024;

// A connection of its own that watches a job and looks at nothing that comes, or at each line where `onLine` does. With
// `binary` it speaks gRPC-Web, as the page does, otherwise JSON lines.
function bareWatch(url, job, { onLine, ca, seconds = 0, binary = false } = {}) {
  const { hostname, port, host, protocol } = new URL(url);
  const socket =
    protocol === "https:" ? tls.connect({ host: hostname, port, ca }) : net.connect({ host: hostname, port });
  let type = "application/json";
  let body = Buffer.from(JSON.stringify({ name: job, min_interval: `${seconds}s` }));
  if (binary) {
    // WatchSolveJobRequest: `name` is field 1, `min_interval` 4, and its nanoseconds 2.
    type = "application/grpc-web+proto";
    const nanos = [];
    for (let rest = seconds * 1e9; rest > 0; rest = Math.floor(rest / 128)) {
      nanos.push((rest % 128) | (rest > 127 ? 128 : 0));
    }
    const interval = nanos.length > 0 ? [0x22, nanos.length + 1, 0x10, ...nanos] : [];
    const message = Buffer.concat([Buffer.from([0x0a, job.length]), Buffer.from(job), Buffer.from(interval)]);
    body = Buffer.concat([Buffer.from([0, 0, 0, 0, message.length]), message]);
  }
  socket.write(
    `POST /dlcs.v1.JobService/WatchSolveJob HTTP/1.1\r\nHost: ${host}\r\nContent-Type: ${type}\r\n` +
      `Content-Length: ${body.length}\r\n\r\n`,
  );
  socket.write(body);
  const stream = { socket, bytes: 0, ended: new Promise((resolve) => socket.once("close", resolve)) };
  stream.begun = new Promise((resolve, reject) => {
    socket.once("data", resolve);
    socket.once("close", () => reject(new Error(`no answer to a watcher: ${stream.error ?? "closed"}`)));
  });
  stream.begun.catch(() => undefined); // for those who do not ask
  let rest = "";
  let tail = "";
  socket.on("data", (data) => {
    stream.bytes += data.length;
    tail = (tail + data.latin1Slice(Math.max(0, data.length - 7))).slice(-7);
    if (tail === "\r\n0\r\n\r\n") socket.end(); // the last chunk
    if (!onLine) return;
    const lines = (rest + data.latin1Slice()).split("\n");
    rest = lines.pop();
    lines.forEach(onLine);
  });
  socket.on("error", (error) => {
    stream.error = error;
    socket.destroy();
  });
  return stream;
}

async function call(url, method, body) {
  const response = await fetch(`${url}/dlcs.v1.${method}`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
  });
  const answer = await response.json();
  if (!response.ok) throw new Error(`${method}: ${JSON.stringify(answer)}`);
  return answer;
}

async function withBrowser(run) {
  const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
  try {
    await run(browser);
  } finally {
    await browser.close();
  }
}

async function withServer(run, ...flags) {
  const dlcsd = await Dlcsd.start(...flags);
  try {
    await run(dlcsd);
  } finally {
    await dlcsd.stop();
  }
}

const newPage = async (browser) =>
  (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();

// Returns the name of the job.
function submit(dlcsd, options, login = []) {
  const server = ["--server", dlcsd.address, ...login, "--patience", "30"];
  const arguments_ = ["submit", example("four-variables"), ...server, "--no-estimate-error", ...options.split(" ")];
  return execFileSync(process.env.DLCS, arguments_, { encoding: "utf8" }).trim();
}

// Solves of so many seconds on one thread: some 50 iterations a second, and some thousands.
const slow = (seconds) =>
  `--threads 1 --method laplace-iteration --steps ${160_000 * seconds} --window 20000 --at 0:0.001:1`;
const fast = (seconds) =>
  `--threads 1 --method laplace-iteration --steps ${700_000 * seconds} --window 500 --at 0:0.001:1`;

// Processor time of the main thread of a page so far, which a busy machine does not make longer.
async function meter(page) {
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  return async () => {
    const { metrics } = await session.send("Performance.getMetrics");
    return 1000 * metrics.find(({ name }) => name === "TaskDuration").value;
  };
}

// From the start of a navigation, nothing cached.
async function paint() {
  const first = [];
  const list = [];
  const busy = [];
  await withServer((dlcsd) =>
    withBrowser(async (browser) => {
      for (let k = 0; k < 21; ++k) {
        const page = await newPage(browser);
        const processor = await meter(page);
        const before = await processor();
        await page.goto(`${dlcsd.url}/`);
        await page.waitForSelector("main *");
        busy.push((await processor()) - before);
        list.push(await page.evaluate(() => performance.now()));
        const painted = () => performance.getEntriesByName("first-contentful-paint")[0]?.startTime;
        await page.waitForFunction(painted);
        first.push(await page.evaluate(painted));
        await page.context().close();
      }
    }),
  );
  say(`first paint with content: ${told(first)}; the list is there: ${told(list)}; processor ` +
      `time of the page ${told(busy)} (${first.length} visits)`);
}

// Of 50,000 points: moved by the mouse, zoomed by the wheel. Every message of the mouse waits for the page.
async function move() {
  await withServer((dlcsd) =>
    withBrowser(async (browser) => {
      const page = await newPage(browser);
      const job = submit(dlcsd, "--method exponential-integrator --steps 50000");
      await page.goto(`${dlcsd.url}/#/${job}`);
      await page.waitForSelector(".verdict:not([hidden])", { timeout: 60_000 });
      const plot = page.locator(".plot .u-over").first();
      await plot.waitFor();
      await pause(3_000);
      const { x, y, width, height } = await plot.boundingBox();
      const processor = await meter(page);
      const [middle, at] = [x + width / 2, y + height / 2];
      const frames = async (name, act) => {
        await page.evaluate(() => {
          window.frames_ = [];
          const next = (time) => (window.frames_?.push(time), window.frames_ && requestAnimationFrame(next));
          requestAnimationFrame(next);
        });
        const begin = Date.now();
        let acts = 0;
        const before = await processor();
        for (; Date.now() - begin < 5_000; ++acts) await act(acts);
        const seconds = (Date.now() - begin) / 1000;
        const busy = (await processor()) - before;
        const times = await page.evaluate(() => {
          const all = window.frames_;
          window.frames_ = null;
          return all;
        });
        const lengths = times.slice(1).map((time, k) => time - times[k]);
        say(
          `${name}: ${(times.length / seconds).toFixed(1)} frames and ${(acts / seconds).toFixed(1)} steps a second; ` +
            `a frame takes ${told(lengths)}; processor time of the page for a step ${(busy / acts).toFixed(1)} ms`,
        );
      };
      await page.locator(".plot:visible").first().focus();
      await page.mouse.move(middle, at);
      await frames("zoom", (k) => page.mouse.wheel(0, Math.floor(k / 20) % 2 === 0 ? -30 : 30));
      await page.keyboard.press("0");
      await page.keyboard.press("+"); // 35,000 of the points
      await page.mouse.move(middle, at);
      await page.mouse.down();
      await frames("move", (k) => page.mouse.move(middle + 150 * Math.sin(k / 15), at));
      await page.mouse.up();
    }),
  );
}

// From the time that the server gives an iteration, when the engine has made it, to the frame after the one in which
// the page has drawn it, which is later than its pixels. Nine others read the same events.
async function age() {
  for (const options of [slow(20), fast(20)]) {
    await withServer((dlcsd) =>
      withBrowser(async (browser) => {
        const page = await newPage(browser);
        await page.addInitScript(() => {
          window.seen_ = [];
          let last = "";
          const look = () => {
            for (const element of document.querySelectorAll(".now")) {
              const found = /^Window (\S+), iteration (\S+):/.exec(element.textContent);
              if (!found || found[0] === last) continue;
              last = found[0];
              const key = `${found[1]}/${found[2].replaceAll(",", "")}`;
              requestAnimationFrame(() => window.seen_.push([key, performance.timeOrigin + performance.now()]));
            }
          };
          new MutationObserver(look).observe(document, { subtree: true, childList: true, characterData: true });
        });
        const job = submit(dlcsd, options);
        const made = new Map();
        const onLine = (line) => {
          if (!line.includes('"iterate"')) return;
          const { time, iterate } = JSON.parse(line);
          made.set(`${iterate.window ?? 0}/${iterate.iteration}`, Date.parse(time));
        };
        await page.goto(`${dlcsd.url}/#/${job}`);
        const readers = Array.from({ length: 9 }, (_, k) =>
          bareWatch(dlcsd.url, job, k === 0 ? { onLine } : {}),
        );
        await Promise.race([Promise.all(readers.map((reader) => reader.ended)), pause(20_000)]);
        await pause(300);
        const seen = await page.evaluate(() => window.seen_);
        const ages = seen.filter(([key]) => made.has(key)).map(([key, time]) => time - made.get(key));
        readers.forEach((reader) => reader.socket.destroy());
        say(`age at ${(made.size / 20).toFixed(0)} iterations a second: ${ages.length} drawn: ${told(ages)}`);
      }),
    );
  }
}

// Processor time of the server for the same job without readers and with ten, in turns.
async function streams() {
  for (const [options, ways] of [
    [slow(8), [{}, { binary: true }]],
    [fast(8), [{ seconds: 0.1 }, { seconds: 0.1, binary: true }, {}, { binary: true }]],
  ]) {
    const cost = Object.fromEntries([["alone", []], ...ways.map((way) => [JSON.stringify(way), []])]);
    let events = 0;
    for (let k = 0; k < 3; ++k) {
      for (const way of [null, ...ways]) {
        await withServer(async (dlcsd) => {
          const job = submit(dlcsd, options);
          const open = way ? Array.from({ length: 10 }, () => bareWatch(dlcsd.url, job, way)) : [];
          for (let state = ""; state !== "JOB_STATE_SUCCEEDED"; ) {
            await pause(200);
            ({ state, last_sequence: events } = await call(dlcsd.url, "JobService/GetSolveJob", { name: job }));
          }
          await Promise.all(open.map((stream) => stream.ended));
          cost[way ? JSON.stringify(way) : "alone"].push(processorSeconds(dlcsd.process_.pid));
        });
      }
    }
    const alone = Math.min(...cost.alone);
    say(`${events} events in ${alone} s of processor time, without readers (${cost.alone.join(", ")})`);
    for (const way of ways) {
      const all = cost[JSON.stringify(way)];
      const more = Math.min(...all) - alone;
      say(
        `  ten readers, ${way.binary ? "gRPC-Web" : "JSON"}, ` +
          `${way.seconds ? `every ${way.seconds} s` : "all events"}: ` +
          `${((100 * more) / alone).toFixed(1)} % more (${all.join(", ")})`,
      );
    }
  }
}

// Watchers of a job that waits.
async function watchers() {
  const folder = mkdtempSync(path.join(tmpdir(), "dlcs-bench-"));
  const [certificate, key] = ["server.pem", "server.key"].map((name) => path.join(folder, name));
  execFileSync("openssl", ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
    "-addext", "subjectAltName=IP:127.0.0.1,DNS:localhost", "-keyout", key, "-out", certificate], { stdio: "ignore" });
  const limits = ["--max-watches-per-user", "2000", "--max-concurrent-solves", "1"];
  for (const secure of [false, true]) {
    const flags = secure ? ["--tls-cert", certificate, "--tls-key", key] : [];
    await withServer(async (dlcsd) => {
      const { pid } = dlcsd.process_;
      const login = secure ? ["--tls", "--tls-ca", certificate] : [];
      // Of some minutes, and of the same memory all the time.
      const long = "--threads 1 --method wu-chen-iteration --steps 4000";
      submit(dlcsd, long, login);
      const name = submit(dlcsd, long, login);
      const open = [];
      const add = async (count) => {
        for (let k = 0; k < count; ++k) {
          open.push(bareWatch(dlcsd.url, name, { ca: readFileSync(certificate) }));
          await open.at(-1).begun;
        }
      };
      await add(50); // what the first ones cost once
      let before = 0;
      // The job that runs takes its memory first.
      for (let k = 0; k < 60 && Math.abs(residentMb(pid) - before) > 0.25; ++k) {
        before = residentMb(pid);
        await pause(500);
      }
      await add(1_000);
      const grown = (residentMb(pid) - before).toFixed(1);
      say(`1,000 idle watchers ${secure ? "with TLS" : "over plain HTTP"}: ${grown} MB`);
      open.forEach(({ socket }) => socket.destroy());
    }, ...limits, ...flags);
  }
  rmSync(folder, { recursive: true });
}

const questions = { paint, move, age, streams, watchers };
for (const name of process.argv.length > 2 ? process.argv.slice(2) : Object.keys(questions)) {
  if (!questions[name]) throw new Error(`${name}: must be one of ${Object.keys(questions).join(", ")}`);
  await questions[name]();
}
