// SPDX-License-Identifier: Apache-2.0
// One solve as the panels of its page show it, whether it is a job or a stream.

import {SwitchingKind, type SwitchingTime} from '../../generated/dlcs/v1/solver_pb';
import type {Span} from '../plots/bars';
import type {SolveModel} from './model';
import type {Trajectory} from './trajectory';

export interface SolveData {
  title: string;
  states: number;
  pairs: number;
  outputs: number;
  horizon: number;
  /** Sizes of the grid that the states are the points of, where that is known. */
  grid: number[];
  model: SolveModel;
  trajectory: Trajectory | null;
}

/** When each of the chosen pairs is active: as the solver says, otherwise where y is larger than w. */
export function activeSpans({model, trajectory, horizon}: SolveData, chosen: number[]): Span[][] {
  const switchings = model.summary?.switchingTimes ?? [];
  const end = model.summary === null ? model.reached : (trajectory?.times.at(-1) ?? horizon);
  if (switchings.length > 0 && switchings.length === model.summary?.switchings)
    return bySwitchings(switchings, end, chosen);
  return chosen.map((pair) => byValues(trajectory, pair));
}

function bySwitchings(switchings: SwitchingTime[], end: number, chosen: number[]): Span[][] {
  const spans = new Map<number, Span[]>(chosen.map((pair) => [pair, []]));
  const since = new Map<number, number>();
  const close = (pair: number, to: number) => {
    const from = since.get(pair);
    since.delete(pair);
    if (from !== undefined) spans.get(pair)?.push({from, to});
  };
  for (const {time, entering, leaving, kind} of switchings) {
    if (kind === SwitchingKind.COUPLED_STEPS_BEGIN) [...since.keys()].forEach((pair) => close(pair, time));
    leaving.forEach((pair) => close(pair, time));
    entering.forEach((pair) => since.has(pair) || since.set(pair, time));
  }
  [...since.keys()].forEach((pair) => close(pair, end));
  return chosen.map((pair) => spans.get(pair)!);
}

function byValues(trajectory: Trajectory | null, pair: number): Span[] {
  const times = trajectory?.times;
  const y = trajectory?.column('y', pair);
  const w = trajectory?.column('w', pair);
  if (!times || !y || !w) return [];
  const spans: Span[] = [];
  let from: number | null = null;
  for (let k = 0; k < times.length; ++k) {
    const active = y[k] > w[k];
    if (active && from === null) from = times[k];
    if (!active && from !== null) {
      spans.push({from, to: times[k]});
      from = null;
    }
  }
  if (from !== null) spans.push({from, to: times[times.length - 1]});
  return spans;
}
