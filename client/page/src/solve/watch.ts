// SPDX-License-Identifier: Apache-2.0
// Follows the events of a job. One stream serves all tabs: the tab whose turn it is passes its events on to those that
// show the same job, and tabs with other jobs take turns with it. Events have numbers, so nothing is lost or doubled.

import {fromBinary, toBinary} from '@bufbuild/protobuf';
import {Code, ConnectError} from '@connectrpc/connect';
import {WatchView} from '../../generated/dlcs/v1/jobs_pb';
import {Gap_Reason, type SolveEvent, SolveEventSchema} from '../../generated/dlcs/v1/solver_pb';
import {milliseconds} from '../format';
import {jobs, loggedIn} from '../rpc/clients';
import {errorText, mayPass} from '../rpc/errors';
import {takeSharedTurn} from '../rpc/turns';

const channelName = 'dlcs-events';
/** A tab that hears nothing for so long asks for the stream itself. The server sends a heartbeat within 15 s. */
const patience = 4_000;
const beatEvery = 1_500;
const retryAfter = 1_500;
/** Events are copied for other tabs only while one of them listens, which it says this often. */
const listenEvery = 250;
/** Clocks differ; what counts is how much older events become than the youngest so far. */
const tooOld = 150;
/** So long a stream may take to catch up with what happened before it. */
const catchesUpIn = 1_000;
/** Where the page cannot keep up it asks for the newest iterate of so many milliseconds. */
const keepsUpWith = 50;

/** Of a tab that has no stream itself. */
interface Listening {
  listensTo: string;
}

interface Shared {
  job: string;
  /** The receiver must have all events up to this number. */
  after: bigint;
  event: Uint8Array | null;
}

export interface Watcher {
  lastSequence(): bigint;
  onEvent(event: SolveEvent): void;
  /** What hinders the stream, or null when it is well. */
  onTrouble(text: string | null): void;
  /** There are no such events (any more): the job ended long ago, or its server forgot them. */
  onNoEvents(): void;
}

export class JobWatch {
  private readonly channel = new BroadcastChannel(channelName);
  private readonly stopped = new AbortController();
  private lastHeard = 0;
  private lastListener = -Infinity;
  private leastAge = Infinity;
  private interval = 0;
  private ended = false;
  private holding = false;
  private waiting: AbortController | null = null;

  constructor(
    private readonly job: string,
    private readonly pairs: () => number[],
    private readonly watcher: Watcher,
  ) {
    this.channel.addEventListener('message', ({data}: MessageEvent<Shared | Listening>) => {
      if (!('listensTo' in data)) this.onShared(data);
      else if (data.listensTo === this.job) this.lastListener = performance.now();
    });
    document.addEventListener('visibilitychange', this.onVisibility);
    void this.run();
  }

  stop(): void {
    this.stopped.abort();
    this.waiting?.abort();
    this.channel.close();
    document.removeEventListener('visibilitychange', this.onVisibility);
  }

  /** Opens the stream anew, after other pairs were chosen. */
  restart(): void {
    this.lastHeard = 0;
    this.waiting?.abort();
  }

  private readonly onVisibility = () => {
    // A hidden tab needs no stream; it catches up when it is seen again.
    if (document.hidden) this.waiting?.abort();
  };

  private async run(): Promise<void> {
    while (!this.ended && !this.stopped.signal.aborted) {
      if (document.hidden || Date.now() - this.lastHeard < patience) {
        if (!document.hidden) this.channel.postMessage({listensTo: this.job} satisfies Listening);
        await pause(listenEvery);
        continue;
      }
      this.waiting = new AbortController();
      try {
        await takeSharedTurn((turn) => this.read(turn), this.waiting.signal);
      } catch (error) {
        if (!this.waiting.signal.aborted) await this.onFailure(error);
      }
    }
  }

  private async onFailure(error: unknown): Promise<void> {
    if (await loggedIn(error)) return;
    const {code} = ConnectError.from(error);
    if (code === Code.OutOfRange || code === Code.NotFound) {
      this.ended = true;
      this.watcher.onNoEvents();
      return;
    }
    this.watcher.onTrouble(errorText(error));
    await pause(mayPass(error) ? retryAfter : 4 * retryAfter);
  }

  private async read(turn: AbortSignal): Promise<void> {
    // While this tab waited for its turn another one may have passed on the events.
    if (this.ended || turn.aborted) return;
    this.holding = true;
    this.share(null);
    const begun = performance.now();
    const beat = setInterval(() => this.share(null), beatEvery);
    try {
      const stream = jobs.watchSolveJob(
        {
          name: this.job,
          afterSequence: this.watcher.lastSequence(),
          view: WatchView.SAMPLED,
          yComponents: this.pairs(),
          minInterval: {seconds: 0n, nanos: this.interval * 1_000_000},
        },
        {signal: turn},
      );
      for await (const event of stream) {
        this.watcher.onTrouble(null);
        this.share(event);
        this.take(event);
        if (this.fallsBehind(event) && performance.now() - begun > catchesUpIn) {
          this.interval = keepsUpWith;
          return;
        }
      }
    } catch (error) {
      if (!turn.aborted) throw error;
    } finally {
      clearInterval(beat);
      this.holding = false;
    }
  }

  // Whether the stream is to be opened anew, with fewer events.
  private fallsBehind({time, kind}: SolveEvent): boolean {
    const age = time === undefined ? 0 : Date.now() - milliseconds(time);
    this.leastAge = Math.min(this.leastAge, age);
    if (this.interval > 0 || kind.case === 'summary') return false;
    return kind.case === 'gap' ? kind.value.reason === Gap_Reason.SLOW : age - this.leastAge > tooOld;
  }

  private take(event: SolveEvent): void {
    if (event.kind.case === 'summary') this.ended = true;
    this.watcher.onEvent(event);
  }

  private share(event: SolveEvent | null): void {
    if (this.stopped.signal.aborted) return;
    if (event !== null && performance.now() - this.lastListener > patience) return;
    const shared: Shared = {
      job: this.job,
      after: this.watcher.lastSequence(),
      event: event && toBinary(SolveEventSchema, event),
    };
    this.channel.postMessage(shared);
  }

  private onShared({job, after, event}: Shared): void {
    if (job !== this.job || this.ended || after > this.watcher.lastSequence()) return;
    this.lastHeard = Date.now();
    if (!this.holding) this.waiting?.abort();
    if (event !== null) {
      const heard = fromBinary(SolveEventSchema, event);
      if (heard.sequence > this.watcher.lastSequence()) this.take(heard);
    }
  }
}

function pause(milliseconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}
