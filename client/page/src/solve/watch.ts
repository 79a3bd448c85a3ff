// SPDX-License-Identifier: Apache-2.0
// Follows the events of a job. One stream serves all tabs: the tab whose turn it is sends its events to those that show
// the same job, and tabs with other jobs take turns with it. Events have numbers, so none is lost or processed twice.

import {fromBinary, toBinary} from '@bufbuild/protobuf';
import {Code, ConnectError} from '@connectrpc/connect';
import {WatchView} from '../../generated/dlcs/v1/jobs_pb';
import {Gap_Reason, type SolveEvent, SolveEventSchema} from '../../generated/dlcs/v1/solver_pb';
import {milliseconds} from '../format';
import {jobs, loggedIn} from '../rpc/clients';
import {errorText, isTransient} from '../rpc/errors';
import {takeSharedTurn} from '../rpc/turns';

const channelName = 'dlcs-events';
/** A tab that receives nothing for this long requests the stream itself. The server sends a heartbeat within 15 s. */
const patience = 4_000;
const beatEvery = 1_500;
const retryAfter = 1_500;
/** Events are sent to other tabs only while one of them listens. It announces that at this interval. */
const listenEvery = 250;
/** The page is slow if events are this much older than the youngest so far. (Clocks of machines differ.) */
const tooOld = 150;
/** The time that a new stream may take to catch up with earlier events. */
const catchesUpIn = 1_000;
/** A slow page requests only the newest iterate of each interval of this many milliseconds. */
const keepsUpWith = 50;

/** Sent by a tab that has no stream itself. */
interface Listening {
  jobListenedTo: string;
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
  /** Why the stream fails, or null while it works. */
  onTrouble(text: string | null): void;
  /** The server has no such events: the job does not exist, or the server no longer holds them. */
  onNoEvents(): void;
}

export class JobWatch {
  private readonly channel = new BroadcastChannel(channelName);
  private readonly stopped = new AbortController();
  private lastReceived = 0;
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
      if (!('jobListenedTo' in data)) this.onShared(data);
      else if (data.jobListenedTo === this.job) this.lastListener = performance.now();
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

  /** Opens a new stream, after other pairs were chosen. */
  restart(): void {
    this.lastReceived = 0;
    this.waiting?.abort();
  }

  private readonly onVisibility = () => {
    // A hidden tab needs no stream; it catches up when it becomes visible.
    if (document.hidden) this.waiting?.abort();
  };

  private async run(): Promise<void> {
    while (!this.ended && !this.stopped.signal.aborted) {
      if (document.hidden || Date.now() - this.lastReceived < patience) {
        if (!document.hidden) this.channel.postMessage({jobListenedTo: this.job} satisfies Listening);
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
    await pause(isTransient(error) ? retryAfter : 4 * retryAfter);
  }

  private async read(turn: AbortSignal): Promise<void> {
    // While this tab waited for its turn, another one may have sent it the remaining events.
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

  // Whether to open a new stream with fewer events.
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
    this.lastReceived = Date.now();
    if (!this.holding) this.waiting?.abort();
    if (event !== null) {
      const received = fromBinary(SolveEventSchema, event);
      if (received.sequence > this.watcher.lastSequence()) this.take(received);
    }
  }
}

function pause(milliseconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}
