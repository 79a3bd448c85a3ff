// SPDX-License-Identifier: Apache-2.0
// Everything that is known about one solve, gathered from its events. A reload of the page resumes: the model is saved
// with the number of its last event.

import {fromJsonString, toJsonString} from '@bufbuild/protobuf';
import {
  type Analysis,
  AnalysisSchema,
  type Iterate,
  JobState,
  type SolveEvent,
  type Summary,
  SummarySchema,
  type WindowFinished,
} from '../../generated/dlcs/v1/solver_pb';
import {Names} from '../names';

export interface WindowRow {
  window: number;
  begin: number;
  end: number;
  steps: number;
  iterations: number;
  result: 'running' | 'accepted' | 'coupled' | 'retried';
  reason: string;
}

/** y of one iterate at some times of its window. */
export interface Curve {
  window: number;
  iteration: number;
  times: number[];
  /** For each time one value per component. */
  y: number[];
  components: number[];
}

const mostCurves = 300;
const mostCurvesOfAWindow = 12;
const mostWindows = 20_000;

/** Numbers of the iterates, one array for each; null if there is none. */
export interface Iterates {
  window: number[];
  iteration: number[];
  change: number[];
  residual: number[];
  bound: (number | null)[];
}

export class SolveModel {
  analysis: Analysis | null = null;
  summary: Summary | null = null;
  state = JobState.UNSPECIFIED;
  iterates: Iterates = {window: [], iteration: [], change: [], residual: [], bound: []};
  windows: WindowRow[] = [];
  retries = 0;
  lastIterate: {window: number; iteration: number; seconds: number} | null = null;
  /** Not saved: new iterates bring new ones. */
  curves: Curve[] = [];
  log: string[] = [];
  /** Events are missing. They are not counted, since after a crash of the server some numbers belong to no event. */
  missed = false;
  lastSequence = 0n;
  /** The time of the problem up to which there is a solution. */
  reached = 0;
  storedTimes = 0;
  progress = 0;
  ended = false;
  /** Grows with every change. */
  version = 0;

  get names(): Names {
    return new Names(this.analysis?.stateNames, this.analysis?.pairNames, this.analysis?.outputNames);
  }

  onEvent(event: SolveEvent): void {
    ++this.version;
    if (event.sequence > this.lastSequence) this.lastSequence = event.sequence;
    const {kind} = event;
    switch (kind.case) {
      case 'state':
        this.state = kind.value;
        break;
      case 'analysis':
        this.analysis = kind.value;
        break;
      case 'windowStarted': {
        const {window, begin, end, steps} = kind.value;
        // After a crash of the server the window that was running begins again.
        const last = this.windows.at(-1);
        if (last?.window === window && last.result === 'running') this.windows.pop();
        this.addWindow({window, begin, end, steps, iterations: 0, result: 'running', reason: ''});
        break;
      }
      case 'iterate':
        this.onIterate(kind.value);
        break;
      case 'windowFinished':
        this.onWindowFinished(kind.value);
        break;
      case 'checkpointed':
        this.reached = Math.max(this.reached, kind.value.time);
        this.storedTimes = kind.value.times;
        this.progress = kind.value.progress;
        break;
      case 'log':
        this.log.push(kind.value);
        break;
      case 'gap':
        this.missed = true;
        break;
      case 'summary':
        this.summary = kind.value;
        this.ended = true;
        break;
      default:
        break;
    }
  }

  private onIterate(iterate: Iterate): void {
    const {window, iteration, seconds} = iterate;
    this.iterates.window.push(window);
    this.iterates.iteration.push(iteration);
    this.iterates.change.push(iterate.change);
    this.iterates.residual.push(iterate.lcpResidual);
    this.iterates.bound.push(iterate.log10Bound ?? null);
    this.lastIterate = {window, iteration, seconds};
    const row = this.windows.at(-1);
    if (row?.window === window) row.iterations = iteration;
    if (iterate.times.length > 0) this.addCurve(iterate);
  }

  private addCurve({window, iteration, times, y, yComponents}: Iterate): void {
    const size = y.length / times.length;
    const components = yComponents.length > 0 ? yComponents : Array.from({length: size}, (_, i) => i);
    this.curves.push({window, iteration, times, y, components});
    // Drops the oldest curve of the window except the first, which shows where the iteration began.
    const ofWindow = this.curves.filter((curve) => curve.window === window);
    if (ofWindow.length > mostCurvesOfAWindow) this.curves.splice(this.curves.indexOf(ofWindow[1]), 1);
    if (this.curves.length > mostCurves) this.curves.shift();
  }

  private addWindow(row: WindowRow): void {
    this.windows.push(row);
    if (this.windows.length > mostWindows) this.windows.shift();
  }

  private onWindowFinished(finished: WindowFinished): void {
    const {window, end, iterations, accepted, coupled, reason} = finished;
    let row = this.windows.at(-1);
    if (row?.window !== window || row.result !== 'running') {
      row = {window, begin: this.reached, end, steps: 0, iterations, result: 'running', reason};
      this.addWindow(row);
    }
    Object.assign(row, {end, iterations, reason, result: coupled ? 'coupled' : accepted ? 'accepted' : 'retried'});
    // It may be less than before, if the solve makes another pass over [0, T].
    if (accepted) this.reached = end;
    if (accepted) return;
    ++this.retries;
    // The window begins again, and its iterates are of no use.
    this.curves = this.curves.filter((curve) => curve.window !== window);
  }

  /** Sets the summary of a job that has ended, which was received without its events. */
  finish(summary: Summary | undefined): void {
    ++this.version;
    if (summary !== undefined) this.summary = summary;
    this.ended = true;
  }

  save(): string {
    const {analysis, summary, curves, ...plain} = this;
    void curves;
    return JSON.stringify({
      ...plain,
      lastSequence: String(this.lastSequence),
      analysis: analysis && toJsonString(AnalysisSchema, analysis),
      summary: summary && toJsonString(SummarySchema, summary),
    });
  }

  static restore(saved: string): SolveModel {
    const {analysis, summary, lastSequence, ...plain} = JSON.parse(saved);
    const model = Object.assign(new SolveModel(), plain) as SolveModel;
    model.lastSequence = BigInt(lastSequence);
    model.analysis = analysis && fromJsonString(AnalysisSchema, analysis);
    model.summary = summary && fromJsonString(SummarySchema, summary);
    return model;
  }
}
