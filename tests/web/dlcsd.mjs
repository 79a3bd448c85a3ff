// SPDX-License-Identifier: Apache-2.0
// The program dlcsd with a page and, by default, a store, in a process of its own.

import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import readline from "node:readline";

export class Dlcsd {
  static start(...flags) {
    const folder = mkdtempSync(path.join(tmpdir(), "dlcs-web-"));
    return Dlcsd.#start(folder, ["--store", path.join(folder, "jobs.db"), ...flags]);
  }

  static startWithoutStore() {
    return Dlcsd.#start(mkdtempSync(path.join(tmpdir(), "dlcs-web-")), []);
  }

  // Starts again with the same store and address, after kill().
  restart() {
    const { folder, url } = this;
    return Dlcsd.#start(folder, ["--store", path.join(folder, "jobs.db")], new URL(url).host);
  }

  static async #start(folder, flags, host = "127.0.0.1:0") {
    const listen = ["--listen", "127.0.0.1:0", "--http-listen", host, "--log-level", "off", "--grace", "0"];
    const process_ = spawn(process.env.DLCSD, [...listen, ...flags], { stdio: ["ignore", "pipe", "inherit"] });
    let address;
    for await (const line of readline.createInterface({ input: process_.stdout })) {
      address ??= /listening on (\S+)/.exec(line)?.[1];
      const url = /https?:\/\/[^/\s]+/.exec(line)?.[0];
      if (url) return Object.assign(new Dlcsd(), { folder, process_, address, url });
    }
    throw new Error("dlcsd has not printed where its page is");
  }

  kill() {
    return this.#end("SIGKILL");
  }

  async stop() {
    if (this.process_.signalCode === null) await this.#end("SIGTERM");
    rmSync(this.folder, { recursive: true });
  }

  async #end(signal) {
    const ended = new Promise((resolve) => this.process_.once("exit", resolve));
    this.process_.kill(signal);
    await ended;
  }
}
