// SPDX-License-Identifier: Apache-2.0
// One stream for all tabs. A browser opens six HTTP/1.1 connections per origin for all its tabs together, so streams of
// a few tabs would leave none for calls. Every stream takes a turn: the Web Locks API passes the turn from tab to
// tab, in the order of the requests. A stream that can be continued later gives up its turn when others wait.

const lock = 'dlcs-stream';
const checkEvery = 250;

// Without locks (in an insecure context) only the streams of this tab take turns.
let last: Promise<unknown> = Promise.resolve();

async function withLock<T>(run: () => Promise<T>, signal: AbortSignal): Promise<T> {
  if (navigator.locks) return await navigator.locks.request(lock, {signal}, run);
  const mine = last.then(() => {
    signal.throwIfAborted();
    return run();
  });
  last = mine.catch(() => undefined);
  return mine;
}

async function othersWait(): Promise<boolean> {
  if (!navigator.locks) return false;
  const {pending} = await navigator.locks.query();
  return (pending ?? []).some((request) => request.name === lock);
}

/** Runs `stream` when its turn comes. Rejects with an AbortError if `signal` comes first. */
export function takeTurn<T>(stream: () => Promise<T>, signal: AbortSignal): Promise<T> {
  return withLock(stream, signal);
}

/**
 * As takeTurn, for a stream that can be continued later: `turn` is aborted with `signal`, and when another stream has
 * been waiting for a moment.
 */
export function takeSharedTurn<T>(stream: (turn: AbortSignal) => Promise<T>, signal: AbortSignal): Promise<T> {
  return withLock(async () => {
    const turn = new AbortController();
    const stop = () => turn.abort();
    signal.addEventListener('abort', stop);
    const timer = setInterval(async () => {
      if (await othersWait()) stop();
    }, checkEvery);
    try {
      return await stream(turn.signal);
    } finally {
      clearInterval(timer);
      signal.removeEventListener('abort', stop);
    }
  }, signal);
}
