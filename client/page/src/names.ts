// SPDX-License-Identifier: Apache-2.0
// Names of components, and words for the enumerations of the contract, as the command line prints them.

import type {DescEnum} from '@bufbuild/protobuf';
import type {EnsembleProgress, SolveJob} from '../generated/dlcs/v1/jobs_pb';
import {
  JobState,
  JobStateSchema,
  MethodSchema,
  PropagatorKindSchema,
  SwitchingKindSchema,
  Termination,
  TerminationSchema,
  type Summary,
} from '../generated/dlcs/v1/solver_pb';
import {count} from './format';

export class Names {
  constructor(
    private readonly states: string[] = [],
    private readonly pairs: string[] = [],
    readonly outputs: string[] = [],
  ) {}

  x(i: number): string {
    return this.states[i] ?? `x${i + 1}`;
  }
  y(i: number): string {
    return this.pairs[i] ?? `y${i + 1}`;
  }
  /** Of an output. */
  z(i: number): string {
    return this.outputs[i] ?? `output ${i + 1}`;
  }
  w(i: number): string {
    return i < this.pairs.length ? `w(${this.pairs[i]})` : `w${i + 1}`;
  }
}

/** METHOD_EVENT_DRIVEN as "event-driven"; number 0 as "auto". */
function word(description: DescEnum, value: number): string {
  if (value === 0) return 'auto';
  const name = description.value[value]?.localName ?? String(value);
  return name.toLowerCase().replaceAll('_', '-');
}

export const methodWord = (value: number) => word(MethodSchema, value);
export const propagatorWord = (value: number) => word(PropagatorKindSchema, value);
export const switchingWord = (value: number) => word(SwitchingKindSchema, value).replaceAll('-', ' ');
export const stateWord = (value: JobState) => word(JobStateSchema, value);

export function hasEnded(state: JobState): boolean {
  return state === JobState.SUCCEEDED || state === JobState.FAILED || state === JobState.CANCELLED;
}

/** Not of a job that is being cancelled already. */
export function canCancel(state: JobState): boolean {
  return !hasEnded(state) && state !== JobState.CANCELLING;
}

/** The status of a job in a word or two: its state, or why its result is of no use; and the state whose look it has. */
export function statusOf({state, summary, ensemble}: SolveJob): {text: string; look: string} {
  const look = stateWord(state);
  if (state !== JobState.SUCCEEDED) return {text: look, look};
  const failed = ensemble?.counts?.failed ?? 0n;
  if (failed > 0n) return {text: `${failed.toLocaleString('en-US')} failed`, look: 'failed'};
  if (summary === undefined || summary.verdict?.success) return {text: look, look};
  return {text: uselessText(summary), look: 'failed'};
}

/** Of a summary without success. */
export function uselessText(summary: Summary): string {
  return summary.termination === Termination.REACHED_END ? 'inaccurate' : verdictText(summary);
}

export function titleOf(job: SolveJob): string {
  return job.title || (job.ensemble === undefined ? 'Untitled solve' : 'Untitled ensemble');
}

/** "300 of 1,000 members, 2 failed". */
export function membersText({members, counts}: EnsembleProgress): string {
  const failed = counts?.failed ?? 0n;
  const done = (counts?.solved ?? 0n) + (counts?.reached ?? 0n) + failed;
  const some = done < members ? `${done.toLocaleString('en-US')} of ` : '';
  return `${some}${count(members, 'member')}${failed > 0n ? `, ${failed.toLocaleString('en-US')} failed` : ''}`;
}

/** The first line of a result, in the words of the command line. */
export function verdictText(summary: Summary): string {
  if (summary.termination === Termination.REACHED_END) return summary.verdict?.text ?? 'reached T';
  return TerminationSchema.value[summary.termination]?.localName ?? String(summary.termination);
}
