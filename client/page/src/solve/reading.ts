// SPDX-License-Identifier: Apache-2.0
// Reads the stored trajectory of a job: as it grows, for the plots, and as a whole, for a file.

import {create} from '@bufbuild/protobuf';
import {
  ReadTrajectoryRequestSchema,
  type ReadTrajectoryRequest,
  type TrajectoryPage,
} from '../../generated/dlcs/v1/jobs_pb';
import {jobs, loggedIn} from '../rpc/clients';
import {isTransient} from '../rpc/errors';
import {takeTurn} from '../rpc/turns';
import {Trajectory} from './trajectory';

/** The most numbers that the plots hold: 8 million, 64 MB. */
export const mostValues = 8e6;
/** Up to this many components, all are read; of more, only those that are shown. */
export const mostComponents = 200;
const mostTries = 20;
/** No events arrive during a read. After it, they get the stream for this many times as long. */
const eventsShare = 15;

/** What to read: components from 0, and every stride-th time. */
export interface Selection {
  xs: number[];
  ys: number[];
  zs: number[];
  stride: number;
}

export function all(count: number): number[] {
  return Array.from({length: count}, (_, i) => i);
}

/** The stride with which `times` times of the selected components fit into the memory of the page. */
export function strideFor(times: number, xs: number, ys: number, zs: number): number {
  return Math.max(1, Math.ceil((times * (xs + 2 * ys + zs)) / mostValues));
}

/**
 * Calls `onPage` with each page of the stored part after `request.resumeToken`. Repeats if the connection breaks.
 * Returns for how many milliseconds it had the stream.
 */
async function readPages(
  request: ReadTrajectoryRequest,
  signal: AbortSignal,
  onPage: (page: TrajectoryPage) => void,
): Promise<number> {
  let begun = 0;
  for (let tries = 1; ; ++tries) {
    try {
      await takeTurn(async () => {
        begun = performance.now();
        for await (const page of jobs.readTrajectory(request, {signal})) {
          onPage(page);
          if (page.resumeToken !== '') request.resumeToken = page.resumeToken;
          tries = 1;
        }
      }, signal);
      return performance.now() - begun;
    } catch (error) {
      if (signal.aborted || (!(await loggedIn(error)) && (!isTransient(error) || tries === mostTries))) throw error;
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
  }
}

/** How many components there are of each kind. */
export interface Sizes {
  states: number;
  pairs: number;
  outputs: number;
}

function requestOf(
  name: string,
  {xs, ys, zs, stride}: Selection,
  {states, pairs, outputs}: Sizes,
): ReadTrajectoryRequest {
  return create(ReadTrajectoryRequestSchema, {
    name,
    stride,
    // An empty list stands for all, which also keeps the request of a large system small.
    xComponents: xs.length === states ? [] : xs,
    yComponents: ys.length === pairs ? [] : ys,
    outputComponents: zs.length === outputs ? [] : zs,
    omitX: xs.length === 0 && states > 0,
    omitY: ys.length === 0 && pairs > 0,
    omitW: ys.length === 0 && pairs > 0,
    omitOutputs: zs.length === 0 && outputs > 0,
  });
}

/** A trajectory that grows while its job runs. */
export class GrowingTrajectory {
  readonly trajectory: Trajectory;
  complete = false;
  private readonly request: ReadTrajectoryRequest;
  private reading = false;
  private again = false;
  private pauseUntil = 0;

  constructor(
    job: string,
    readonly selection: Selection,
    sizes: Sizes,
    private readonly signal: AbortSignal,
    private readonly onChange: (error?: unknown) => void,
  ) {
    this.trajectory = new Trajectory(selection.xs, selection.ys, selection.zs);
    this.request = requestOf(job, selection, sizes);
  }

  /** Reads what is new. Unless it is urgent, it may wait for a later call. */
  async update(urgent: boolean): Promise<void> {
    if (this.complete || (!urgent && performance.now() < this.pauseUntil)) return;
    this.again = true;
    if (this.reading) return;
    this.reading = true;
    try {
      while (this.again && !this.signal.aborted) {
        this.again = false;
        const taken = await readPages(this.request, this.signal, (page) => {
          if (page.chunk !== undefined) this.trajectory.add(page.chunk, this.selection.stride);
          this.complete = page.complete;
          this.onChange();
        });
        this.pauseUntil = performance.now() + eventsShare * taken;
      }
    } catch (error) {
      if (!this.signal.aborted) this.onChange(error);
    } finally {
      this.reading = false;
    }
  }
}

/** All pages of all components, one after the other. */
export async function readWhole(
  job: string,
  signal: AbortSignal,
  onPage: (page: TrajectoryPage) => void,
): Promise<void> {
  await readPages(create(ReadTrajectoryRequestSchema, {name: job}), signal, onPage);
}
