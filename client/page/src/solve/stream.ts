// SPDX-License-Identifier: Apache-2.0
// A solve on a server that keeps no jobs: one call that lasts as long as the solve. It continues while other views
// of the page are shown, and ends with the tab.

import type {SolveRequest, TrajectoryChunk} from '../../generated/dlcs/v1/solver_pb';
import {loggedIn, shortCall, solver} from '../rpc/clients';
import {errorText} from '../rpc/errors';
import {takeTurn} from '../rpc/turns';
import type {SolveData} from './data';
import {SolveModel} from './model';
import {all} from './reading';
import {Trajectory} from './trajectory';

export class StreamedSolve {
  readonly model = new SolveModel();
  readonly chunks: TrajectoryChunk[] = [];
  readonly startedAt = Date.now();
  endedAt = 0;
  trouble: string | null = null;
  waiting = true;
  onChange: () => void = () => undefined;
  private trajectory: Trajectory | null = null;
  private solveId = '';
  private readonly aborted = new AbortController();

  constructor(
    private readonly request: SolveRequest,
    readonly title: string,
    private readonly horizon: number,
    private readonly grid: number[],
  ) {
    void this.run();
  }

  get data(): SolveData {
    const {model} = this;
    return {
      title: this.title,
      states: model.analysis?.states ?? 0,
      pairs: model.analysis?.constraints ?? 0,
      outputs: model.analysis?.outputNames.length ?? 0,
      horizon: this.horizon,
      grid: this.grid,
      model,
      trajectory: this.trajectory,
    };
  }

  get running(): boolean {
    return this.endedAt === 0;
  }

  /** Stops the solve; the part found so far is kept. */
  async stop(): Promise<void> {
    if (this.solveId === '') {
      this.aborted.abort();
    } else {
      await solver.stopSolve({solveId: this.solveId}, shortCall());
    }
  }

  private async run(): Promise<void> {
    for (;;) {
      try {
        await takeTurn(() => this.read(), this.aborted.signal);
      } catch (error) {
        if (!this.aborted.signal.aborted && (await loggedIn(error))) continue;
        this.trouble = this.aborted.signal.aborted ? 'It was cancelled before it began.' : errorText(error);
      }
      break;
    }
    this.endedAt = Date.now();
    this.model.ended = true;
    this.onChange();
  }

  private async read(): Promise<void> {
    this.waiting = false;
    for await (const event of solver.solve(this.request, {signal: this.aborted.signal})) {
      const {kind} = event;
      if (kind.case === 'accepted') this.solveId = kind.value.solveId;
      if (kind.case === 'trajectory') this.onChunk(kind.value);
      this.model.onEvent(event);
      this.onChange();
    }
  }

  private onChunk(chunk: TrajectoryChunk): void {
    this.chunks.push(chunk);
    const size = (values: number[]) => values.length / Math.max(1, chunk.times.length);
    this.trajectory ??= new Trajectory(all(size(chunk.x)), all(size(chunk.y)), all(size(chunk.outputs)));
    this.trajectory.add(chunk);
  }
}

/** The last solve of this tab. */
export const streamed: {solve: StreamedSolve | null} = {solve: null};
