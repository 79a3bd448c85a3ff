// SPDX-License-Identifier: Apache-2.0
// Starts a job and follows it from its first event. A server holds the iterations of a job only while it runs or is
// watched, so a page that creates a job and then watches it misses those of a short one. The call Solve with a
// request_id does both at once.

import type {SolveJob} from '../../generated/dlcs/v1/jobs_pb';
import type {SolveRequest} from '../../generated/dlcs/v1/solver_pb';
import {jobs, loggedIn, shortCall, solver} from '../rpc/clients';
import {isTransient} from '../rpc/errors';
import {takeSharedTurn} from '../rpc/turns';
import {SolveModel} from './model';

const mostTries = 5;
// If other streams do not release their turn for this long, the job is created without following it at once.
const patience = 1_500;

export interface Started {
  /** Its events so far. The page of the job starts from them. */
  model: SolveModel;
  /** The call that started it is no longer read. */
  left: Promise<void>;
}

/** The jobs that were started in this tab. */
export const startedJobs = new Map<string, Started>();

/** Returns the name of the job. Repeats the call where the connection breaks; the request_id makes it the same job. */
export async function startJob(request: SolveRequest): Promise<string> {
  return withRetries(async () => {
    const name = await follow(request);
    if (name !== null) return name;
    const {title, requestId} = request;
    return (await jobs.createSolveJob({solve: request, title, requestId}, shortCall())).name;
  });
}

/** Only checks the request; the answer predicts what the job would cost. */
export function predictJob(request: SolveRequest): Promise<SolveJob> {
  const {title} = request;
  return withRetries(() => jobs.createSolveJob({solve: request, title, validateOnly: true}, shortCall()));
}

// Resolves as soon as the job has a name, and continues to read until others need the turn; null if there was no turn.
function follow(request: SolveRequest): Promise<string | null> {
  return new Promise((resolve, reject) => {
    const waiting = new AbortController();
    const timer = setTimeout(() => {
      waiting.abort();
      resolve(null);
    }, patience);
    takeSharedTurn(async (turn) => {
      clearTimeout(timer);
      await readEvents(request, turn, resolve);
    }, waiting.signal).catch((error) => {
      if (!waiting.signal.aborted) reject(error);
    });
  });
}

async function readEvents(request: SolveRequest, turn: AbortSignal, onName: (name: string) => void): Promise<void> {
  // Ends this call, not the job.
  const call = new AbortController();
  const model = new SolveModel();
  let leave = () => {};
  const left = new Promise<void>((resolve) => (leave = resolve));
  let named = false;
  const stop = () => named && call.abort();
  turn.addEventListener('abort', stop);
  try {
    for await (const event of solver.solve(request, {signal: call.signal})) {
      if (event.kind.case === 'accepted') {
        named = true;
        startedJobs.set(event.kind.value.job, {model, left});
        onName(event.kind.value.job);
        if (turn.aborted) return;
      } else if (event.kind.case === 'trajectory') {
        return; // the page reads what it shows of the trajectory
      } else {
        model.onEvent(event);
      }
    }
  } catch (error) {
    if (!named) throw error;
  } finally {
    turn.removeEventListener('abort', stop);
    call.abort();
    leave();
  }
}

async function withRetries<T>(call: () => Promise<T>): Promise<T> {
  for (let tries = 1; ; ++tries) {
    try {
      return await call();
    } catch (error) {
      if (!(await loggedIn(error)) && (!isTransient(error) || tries === mostTries)) throw error;
      await new Promise((resolve) => setTimeout(resolve, 500 * tries));
    }
  }
}
