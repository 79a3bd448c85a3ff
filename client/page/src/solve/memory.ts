// SPDX-License-Identifier: Apache-2.0
// What the page keeps of a solve after a reload: its events so far, for this tab, and the grid of a problem that was
// submitted here, which the server does not know.

import {SolveModel} from './model';
import {startedJobs} from './start';

const modelKey = (job: string) => `dlcs-solve ${job}`;
const gridKey = (job: string) => `dlcs-grid ${job}`;

// More do not fit into the storage of a tab, some megabytes.
const mostIterates = 40_000;

export function saveModel(job: string, model: SolveModel): void {
  if (model.iterates.change.length > mostIterates) {
    forgetModel(job);
    return;
  }
  try {
    for (const key of Object.keys(sessionStorage)) {
      if (key.startsWith('dlcs-solve ') && key !== modelKey(job)) sessionStorage.removeItem(key);
    }
    sessionStorage.setItem(modelKey(job), model.save());
  } catch {
    // It does not fit. The server then sends the events again.
    sessionStorage.removeItem(modelKey(job));
  }
}

export function restoreModel(job: string): SolveModel {
  const started = startedJobs.get(job);
  if (started !== undefined) return started.model;
  try {
    const saved = sessionStorage.getItem(modelKey(job));
    if (saved !== null) return SolveModel.restore(saved);
  } catch {
    sessionStorage.removeItem(modelKey(job));
  }
  return new SolveModel();
}

export function forgetModel(job: string): void {
  sessionStorage.removeItem(modelKey(job));
}

export function rememberGrid(job: string, grid: number[]): void {
  if (grid.length === 0) return;
  try {
    localStorage.setItem(gridKey(job), JSON.stringify(grid));
  } catch {
    // Only a convenience.
  }
}

export function gridOf(job: string): number[] {
  try {
    return JSON.parse(localStorage.getItem(gridKey(job)) ?? '[]') as number[];
  } catch {
    return [];
  }
}
