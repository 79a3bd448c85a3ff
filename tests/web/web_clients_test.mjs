// SPDX-License-Identifier: Apache-2.0
// The clients on npm call every method of the contract over HTTP/1.1, on a real dlcsd.
//
// Environment: DLCSD, the program; PROJECT, the folder of the project. Messages and methods come from
// proto/released.binpb; nothing is generated.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, before, describe, test } from "node:test";
import { setTimeout as sleep } from "node:timers/promises";

import { createFileRegistry, create, fromBinary, fromJson, toBinary } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import { Code, ConnectError, createClient } from "@connectrpc/connect";
import * as connectNode from "@connectrpc/connect-node";
import * as connectWeb from "@connectrpc/connect-web";
import grpcWeb from "grpc-web";
import xhr2 from "xhr2";

import { Dlcsd } from "./dlcsd.mjs";

globalThis.XMLHttpRequest = xhr2.XMLHttpRequest ?? xhr2; // what browsers have

const released = readFileSync(path.join(process.env.PROJECT, "proto/released.binpb"));
const types = createFileRegistry(fromBinary(FileDescriptorSetSchema, released));
const services = ["SolverService", "JobService", "ProblemService"].map((name) => types.getService(`dlcs.v1.${name}`));
const methods = new Map(services.flatMap((service) => service.methods.map((method) => [method.name, method])));
const badRequest = types.getMessage("google.rpc.BadRequest");
const statusType = types.getMessage("google.rpc.Status");

// --- The clients, behind one interface:
//   unary(method, request, options) -> response,
//   stream(method, request, options) -> events, with options {headers, timeoutMs, signal}. Errors are ConnectErrors.

class ConnectClient {
  constructor(transport) {
    this.clients = new Map(services.map((service) => [service, createClient(service, transport)]));
  }
  unary(method, request, options) {
    return this.clients.get(method.parent)[method.localName](request, options);
  }
  stream(method, request, options) {
    return this.clients.get(method.parent)[method.localName](request, options);
  }
  upload(method, requests) {
    return this.clients.get(method.parent)[method.localName](requests);
  }
}

class GrpcWebClient {
  constructor(url, format) {
    this.url = url;
    this.client = new grpcWeb.GrpcWebClientBase({ format });
  }

  descriptor(method) {
    return new grpcWeb.MethodDescriptor(
      `/${method.parent.typeName}/${method.name}`,
      method.methodKind === "server_streaming" ? "server_streaming" : "unary",
      Object,
      Object,
      (request) => toBinary(method.input, request),
      (bytes) => fromBinary(method.output, bytes),
    );
  }

  start(method, request, { headers = {}, timeoutMs, signal } = {}) {
    const metadata = { ...headers };
    // This client has a deadline as an option, and sends the remaining time.
    if (timeoutMs !== undefined) metadata.deadline = String(Date.now() + timeoutMs);
    const target = this.url + `/${method.parent.typeName}/${method.name}`;
    const call = this.client.serverStreaming(target, request, metadata, this.descriptor(method));
    signal?.addEventListener("abort", () => call.cancel());
    return call;
  }

  async *stream(method, request, options = {}) {
    const queue = [];
    let wake = () => {};
    const put = (item) => (queue.push(item), wake());
    this.start(method, create(method.input, request), options)
      .on("data", (event) => put({ event }))
      .on("error", (error) => put({ error }))
      .on("end", () => put({ end: true }));
    options.signal?.addEventListener("abort", () => put({ error: { code: Code.Canceled, message: "aborted" } }));
    for (;;) {
      while (queue.length === 0) await new Promise((resolve) => (wake = resolve));
      const { event, error, end } = queue.shift();
      if (error) throw this.errorOf(error);
      if (end) return;
      yield event;
    }
  }

  async unary(method, request, options = {}) {
    const { headers = {}, timeoutMs } = options;
    const metadata = { ...headers };
    if (timeoutMs !== undefined) metadata.deadline = String(Date.now() + timeoutMs);
    const target = this.url + `/${method.parent.typeName}/${method.name}`;
    try {
      return await this.client.unaryCall(
        target, create(method.input, request), metadata, this.descriptor(method));
    } catch (error) {
      throw this.errorOf(error);
    }
  }

  errorOf({ code, message, metadata = {} }) {
    const error = new ConnectError(message, code);
    const details = metadata["grpc-status-details-bin"];
    if (details !== undefined) {
      const status = fromBinary(statusType, Buffer.from(details, "base64"));
      error.details = status.details.map(({ typeUrl, value }) => ({ type: typeUrl.split("/").pop(), value }));
    }
    return error;
  }
}

// `uploads`: what becomes of a client stream. "works"; "server refuses": the client sends it, and gRPC-Web has no such
// streams; "client refuses": the client never sends one.
const clients = [
  ["connect-node, Connect, protobuf", "works", (baseUrl) => new ConnectClient(
    connectNode.createConnectTransport({ baseUrl, httpVersion: "1.1", useBinaryFormat: true }))],
  ["connect-node, Connect, JSON", "works", (baseUrl) => new ConnectClient(
    connectNode.createConnectTransport({ baseUrl, httpVersion: "1.1", useBinaryFormat: false }))],
  ["connect-node, gRPC-Web", "server refuses", (baseUrl) => new ConnectClient(
    connectNode.createGrpcWebTransport({ baseUrl, httpVersion: "1.1" }))],
  ["connect-web, Connect, protobuf", "client refuses", (baseUrl) => new ConnectClient(
    connectWeb.createConnectTransport({ baseUrl, useBinaryFormat: true }))],
  ["connect-web, Connect, JSON", "client refuses", (baseUrl) => new ConnectClient(
    connectWeb.createConnectTransport({ baseUrl, useBinaryFormat: false }))],
  ["connect-web, gRPC-Web", "client refuses", (baseUrl) => new ConnectClient(
    connectWeb.createGrpcWebTransport({ baseUrl }))],
  // In browsers the text form hands out the messages of a stream at once; in Node, both do at the end.
  ["grpc-web, text", "server refuses", (url) => new GrpcWebClient(url, "text")],
  ["grpc-web, binary", "server refuses", (url) => new GrpcWebClient(url, "binary")],
];

// --- Requests

const matrix = (value) => ({ dense: { rows: 1, columns: 1, values: [value] } });
const formula = (text) => ({ pieces: [{ formulas: { formulas: [text] } }] });
const problem = {
  a: matrix(-1), b: matrix(10), n: matrix(1), m: matrix(0.1),
  f: formula("0"), g: formula("-10*sin(2*pi*t)"), x0: [0], horizon: 2,
};
const request = (method, json) => fromJson(methods.get(method).input, json, { registry: types });
const steps = (count, more = {}) => ({ steps: count, method: "METHOD_TIME_STEPPING", ...more });
const short = { problem, options: { outputTimes: [0, 1, 2] } };
// Fifty of them in one, which takes minutes on any machine.
const copies = 50;
const diagonal = (value) => {
  const values = Array.from({ length: copies ** 2 }, (_, k) => (k % (copies + 1) ? 0 : value));
  return { dense: { rows: copies, columns: copies, values } };
};
const formulas = (text) => ({ pieces: [{ formulas: { formulas: Array(copies).fill(text) } }] });
const long = {
  problem: {
    a: diagonal(-1), b: diagonal(10), n: diagonal(1), m: diagonal(0.1),
    f: formulas("0"), g: formulas("-10*sin(2*pi*t)"), x0: Array(copies).fill(0), horizon: 2,
  },
  options: steps(10_000_000, { outputTimes: [0] }),
};

async function all(events) {
  const list = [];
  for await (const event of events) list.push(event);
  return list;
}

async function failure(promise) {
  try {
    await promise;
  } catch (error) {
    return ConnectError.from(error);
  }
  return assert.fail("the call has not failed");
}

const enumerator = (type, name) => types.getEnum(`dlcs.v1.${type}`).values.find((value) => value.name === name).number;

describe("clients from npm", () => {
  let dlcsd, narrow, guarded;
  before(async () => {
    dlcsd = await Dlcsd.start("--max-concurrent-solves", "4");
    narrow = await Dlcsd.start("--max-concurrent-solves", "1");
    const folder = mkdtempSync(path.join(tmpdir(), "dlcs-web-"));
    const file = path.join(folder, "tokens.txt");
    const user = (name, right) => {
      const saved = path.join(folder, name);
      const line = execFileSync(process.env.DLCSD, ["token", name, "--right", right, "--save", saved]);
      writeFileSync(file, line, { flag: "a" });
      return readFileSync(saved, "utf8").trim();
    };
    const tokens = { submitter: user("alice", "submitter"), reader: user("bob", "reader") };
    guarded = Object.assign(await Dlcsd.start("--tokens", file), { tokens });
    rmSync(folder, { recursive: true, force: true });
  });
  after(() => Promise.all([dlcsd, narrow, guarded].map((server) => server?.stop())));

  for (const [name, uploads, make] of clients) {
    describe(name, () => {
      const called = new Set();
      const using = (server) => {
        const client = make(server.url);
        return {
          unary: (method, json = {}, options = {}) => {
            called.add(method);
            return client.unary(methods.get(method), request(method, json), options);
          },
          stream: (method, json = {}, options = {}) => {
            called.add(method);
            return client.stream(methods.get(method), request(method, json), options);
          },
          client,
        };
      };
      const streams = !name.startsWith("grpc-web,"); // messages before the end of the response

      test("unary calls", async () => {
        const { unary } = using(dlcsd);
        const capabilities = await unary("GetCapabilities");
        assert.equal(capabilities.maxStates, 1_000_000);
        assert.ok(capabilities.methods.length >= 5);
        const lcp = await unary("SolveLcp", { m: matrix(2), q: [-4] });
        assert.deepEqual([...lcp.y], [2]);
        const dcp = await unary("SolveDcp", { m: matrix(1), q: { times: [0, 1], values: [0, -1] } });
        assert.equal(dcp.solved, true);
        const analysis = await unary("AnalyzeProblem", { problem });
        assert.equal(analysis.states, 1);
        assert.ok(analysis.sections.length > 0);
        const unknown = await failure(unary("StopSolve", { solveId: "nothing-of-the-kind" }));
        assert.equal(unknown.code, Code.NotFound);
      });

      test("a solve, to its summary", async () => {
        const events = await all(using(dlcsd).stream("Solve", short));
        assert.equal(events[0].kind.case, "accepted");
        const { kind } = events.at(-1);
        assert.equal(kind.case, "summary");
        assert.equal(kind.value.termination, enumerator("Termination", "TERMINATION_REACHED_END"));
        const times = events.filter(({ kind }) => kind.case === "trajectory").flatMap(({ kind }) => kind.value.times);
        assert.deepEqual(times, [0, 1, 2]);
      });

      test("an ensemble", async () => {
        const members = [{ x0: [0], label: "rest" }, { x0: [1], label: "away" }];
        const events = await all(using(dlcsd).stream("SolveEnsemble", { ...short, members }));
        assert.equal(events.at(-1).kind.case, "summary");
        assert.equal(events.at(-1).kind.value.solved, 2);
      });

      test("a job: created, watched, read, listed, cancelled, deleted", async () => {
        const { unary, stream } = using(dlcsd);
        const { name: job } = await unary("CreateSolveJob", { solve: short });
        const events = await all(stream("WatchSolveJob", { name: job }));
        assert.equal(events.at(-1).kind.case, "summary");
        const pages = await all(stream("ReadTrajectory", { name: job }));
        assert.deepEqual(pages.flatMap(({ chunk }) => chunk?.times ?? []), [0, 1, 2]);
        assert.equal(pages.at(-1).complete, true);
        assert.equal((await unary("GetSolveJob", { name: job })).state, enumerator("JobState", "JOB_STATE_SUCCEEDED"));
        const { jobs } = await unary("ListSolveJobs");
        assert.ok(jobs.some(({ name }) => name === job));

        const { name: endless } = await unary("CreateSolveJob", { solve: long });
        await unary("CancelSolveJob", { name: endless });
        const ended = await all(stream("WatchSolveJob", { name: endless }));
        assert.equal(ended.at(-1).kind.case, "summary");
        for (const name of [job, endless]) await unary("DeleteSolveJob", { name });
        assert.equal((await failure(unary("GetSolveJob", { name: job }))).code, Code.NotFound);
      });

      test("an ensemble that is a job: created, followed, resumed", async () => {
        const { unary, stream } = using(dlcsd);
        const members = Array.from({ length: 5 }, (_, k) => ({ x0: [k] }));
        const given = { ensemble: { ...short, members }, shardMembers: 2 };
        const { name: job, ensemble } = await unary("CreateEnsembleJob", given);
        assert.equal(Number(ensemble.members), members.length);
        const pages = await all(stream("ReadEnsemble", { name: job, follow: true }));
        assert.equal(pages.at(-1).complete, true);
        const first = ({ shard }) => Number(shard.firstMember);
        const shards = pages.filter(({ shard }) => shard);
        assert.deepEqual(shards.map(first).sort(), [0, 2, 4]);
        assert.equal(shards.flatMap(({ shard }) => shard.outcomes).length, members.length);
        const rest = await all(stream("ReadEnsemble", { name: job, resumeToken: shards[0].resumeToken }));
        assert.deepEqual(rest.filter(({ shard }) => shard).map(first), shards.slice(1).map(first));
        await unary("DeleteSolveJob", { name: job });
      });

      test("an uploaded problem", async () => {
        const { client, unary, stream } = using(dlcsd);
        const upload = methods.get("UploadProblem");
        const body = fromJson(types.getMessage("dlcs.v1.ProblemBody"), { problem, title: name }, { registry: types });
        const bytes = toBinary(types.getMessage("dlcs.v1.ProblemBody"), body);
        const sha256 = createHash("sha256").update(bytes).digest();
        const parts = async function* () {
          const part = (value) => create(upload.input, { part: value });
          yield part({ case: "start", value: { bytes: BigInt(bytes.length), sha256: new Uint8Array(sha256) } });
          for (let k = 0; k < bytes.length; k += 100) {
            yield part({ case: "data", value: bytes.subarray(k, k + 100) });
          }
        };
        called.add("UploadProblem");
        if (uploads !== "works") {
          const sent = client.upload?.(upload, parts()) ?? client.unary(upload, create(upload.input));
          const refused = await failure(sent);
          assert.equal(refused.code, uploads === "server refuses" ? Code.Unimplemented : Code.Unknown);
          if (uploads === "server refuses") assert.match(refused.message, /UploadProblem|stream/);
        }
        const uploading = uploads === "works" ? client : clients[0][2](dlcsd.url);
        const { problem: stored } = await uploading.upload(upload, parts());
        assert.equal(stored.bytes, BigInt(bytes.length));
        assert.equal((await unary("GetProblem", { name: stored.name })).title, name);
        assert.ok((await unary("ListProblems")).problems.some((one) => one.name === stored.name));
        const again = await unary("CreateProblem", { problem, title: name });
        assert.equal(again.name, stored.name);
        const solved = await all(stream("Solve", { problemName: stored.name, options: short.options }));
        assert.equal(solved.at(-1).kind.case, "summary");
        await unary("DeleteProblem", { name: stored.name });
        assert.equal((await failure(unary("GetProblem", { name: stored.name }))).code, Code.NotFound);
        // In one call, which every client can make.
        const created = await unary("CreateProblem", { problem, title: name });
        assert.equal(created.name, stored.name);
        await unary("DeleteProblem", { name: created.name });
      });

      test("errors have code and details", async () => {
        const { unary, stream } = using(dlcsd);
        const wrong = { problem: { horizon: 1 } };
        for (const call of [() => unary("AnalyzeProblem", wrong), () => all(stream("Solve", wrong))]) {
          const error = await failure(call());
          assert.equal(error.code, Code.InvalidArgument);
          const detail = error.details.find(({ type }) => type === badRequest.typeName);
          assert.ok(detail, "a google.rpc.BadRequest");
          assert.equal(fromBinary(badRequest, detail.value).fieldViolations[0].field, "problem.a");
        }
      });

      test("a deadline stops a solve, which has a result", async () => {
        // The header alone. With `timeoutMs` the client's clock runs too, from before the request leaves: on a busy
        // machine it may give up before the result is there, although the server stops half a second early.
        const speaksConnect = name.includes(", Connect,");
        const headers = speaksConnect ? { "connect-timeout-ms": "5000" } : { "grpc-timeout": "5000m" };
        // A machine that stands still for that half second loses the result.
        for (let tries = 1; ; ++tries) {
          try {
            const events = await all(using(dlcsd).stream("Solve", long, { headers }));
            assert.equal(events.at(-1).kind.value.termination, enumerator("Termination", "TERMINATION_DEADLINE"));
            break;
          } catch (error) {
            if (error.code !== Code.DeadlineExceeded || tries === 3) throw error;
          }
        }
      });

      test("the timeout of a client reaches the server", async () => {
        // The deadline of a job is that of the call which creates it, less a second for the result.
        const { unary, stream } = using(dlcsd);
        const sent = Date.now();
        await all(stream("Solve", { ...short, requestId: name }, { timeoutMs: 600_000 }));
        const { jobs } = await unary("ListSolveJobs");
        const { deadline } = jobs.find(({ requestId }) => requestId === name);
        const seconds = Number(deadline.seconds) - sent / 1000;
        assert.ok(seconds > 590 && seconds < 660, `${seconds} s`);
      });

      test("a deadline ends a watch", async () => {
        const { unary, stream } = using(dlcsd);
        const { name: job } = await unary("CreateSolveJob", { solve: long });
        const late = await failure(all(stream("WatchSolveJob", { name: job }, { timeoutMs: 700 })));
        assert.equal(late.code, Code.DeadlineExceeded);
        await unary("CancelSolveJob", { name: job });
      });

      test("a client that gives up ends its solve", async () => {
        const { stream } = using(narrow);
        const controller = new AbortController();
        const events = stream("Solve", long, { signal: controller.signal })[Symbol.asyncIterator]();
        const first = events.next();
        first.catch(() => {}); // where it comes at the end of the response, it does not come
        if (streams) {
          assert.equal((await first).value.kind.case, "accepted");
          // The only solver is busy.
          assert.equal((await failure(all(stream("Solve", short)))).code, Code.ResourceExhausted);
        } else {
          await sleep(500);
        }
        controller.abort();
        for (const giveUp = Date.now() + 10_000; ; await sleep(50)) {
          try {
            await all(stream("Solve", short));
            break;
          } catch (error) {
            assert.equal(error.code, Code.ResourceExhausted);
            assert.ok(Date.now() < giveUp, "the solve goes on without its client");
          }
        }
      });

      test("4 MB and more, there and back", async () => {
        // One large message; answers come in messages of less than 1 MB.
        const count = 600_000;
        const outputTimes = Array.from({ length: count }, (_, k) => k / 524_288);
        const events = await all(using(dlcsd).stream("Solve", { problem, options: steps(1000, { outputTimes }) }));
        const points = events
          .filter(({ kind }) => kind.case === "trajectory")
          .reduce((sum, { kind }) => sum + kind.value.times.length, 0);
        assert.equal(points, count);
      });

      test("tokens", async () => {
        const { unary, stream } = using(guarded);
        const as = (token) => ({ headers: { authorization: `Bearer ${token}` } });
        const { submitter, reader } = guarded.tokens;
        assert.equal((await failure(unary("ListSolveJobs"))).code, Code.Unauthenticated);
        assert.equal((await failure(unary("ListSolveJobs", {}, as("wrong")))).code, Code.Unauthenticated);
        assert.equal((await unary("ListSolveJobs", {}, as(reader))).jobs.length, 0);
        assert.equal((await failure(all(stream("Solve", short, as(reader))))).code, Code.PermissionDenied);
        assert.equal((await all(stream("Solve", short, as(submitter)))).at(-1).kind.case, "summary");
      });

      test("every method was called", () => {
        assert.deepEqual([...called].sort(), [...methods.keys()].sort());
      });
    });
  }
});
